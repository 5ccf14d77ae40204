(two pockets; the lift between them goes by G91, and G90 is missing behind it)
G21 G17 G90 G94
M3 S12000
G4 P3
G0 Z5
G0 X10 Y10
G1 Z-1 F300
X50 F1200
G91 G0 Z6
X10 Y30
G1 Z-1 F300
X50 F1200
G90 G0 Z5
M5
M30
