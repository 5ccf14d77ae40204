(G90 is missing after the way to the top: all that follows is taken as steps)
G21 G17 G94
G28 G91 Z0
M3 S12000
G4 P3
G0 X10 Y10 Z5
G1 Z-1 F300
X50 F1200
Y30
G0 Z5
M5
M30
