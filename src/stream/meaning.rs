//! The numbers of `error:` and `ALARM:` in words: what it means, and what to do (GRBL 1.1 `report.h`, `system.h`).

/// What the number after `error:` means, and the cure.
pub fn error(code: u16) -> (&'static str, &'static str) {
    match code {
        1 => ("a word does not begin with a letter", "correct the line"),
        2 => ("a letter has no number, or one that GRBL cannot read", "correct the number"),
        3 => ("a $ command that GRBL does not know", "correct the command"),
        4 => ("a value is negative where it may not be", "correct the value"),
        5 => (
            "homing is switched off",
            "switch it on ($22=1) if the machine has switches, or take $H out",
        ),
        6 => ("a step pulse below 3 us", "set $0 to 3 or more"),
        7 => (
            "the EEPROM could not be read",
            "its values are back to the factory's: compare $$ with your notes",
        ),
        8 => ("this command is only taken at rest", "wait until the machine is idle"),
        9 => ("the machine is locked or jogging", "home it ($H) or unlock it ($X)"),
        10 => ("soft limits need homing", "switch homing on first ($22=1)"),
        11 => ("the line is too long for GRBL's buffer", "split the line"),
        12 => ("the step rate is too high", "lower $110-$112 or the steps per millimetre"),
        13 => ("the safety door is open", "close the door"),
        14 => ("the build info or startup line is too long", "shorten it"),
        15 => ("the jog leads out of the travel", "jog less far"),
        16 => ("the jog has no = or a word that jogs do not have", "correct the jog"),
        17 => ("laser mode needs a PWM spindle", "set $32=0"),
        20 => (
            "GRBL does not have this command",
            "take it out, or post-process the program for GRBL 1.1",
        ),
        21 => ("two commands of one modal group", "keep one of them, or split the line"),
        22 => ("no feed is set", "write F before or on this line"),
        23 => ("a G or M number that must be whole is not", "correct the number"),
        24 => ("two commands want the axis words", "split the line"),
        25 => ("a letter stands twice", "keep one of them"),
        26 => ("axis words are missing", "write X, Y or Z"),
        27 => ("the line number N is above 10000000", "leave N out"),
        28 => ("a word that the command needs is missing", "write it (P for G4, P or L for G10)"),
        29 => ("a coordinate system that does not exist", "use P0 to P6"),
        30 => ("G53 only goes with G0 or G1", "write G0 or G1 on the line"),
        31 => ("axis words, but no motion is on (G80)", "write G0, G1, G2 or G3"),
        32 => ("the arc has no axis word in its plane", "check G17, G18, G19 and the end point"),
        33 => (
            "the arc's ends do not lie on one circle, or a probe goes nowhere",
            "correct end and centre",
        ),
        34 => ("the arc's radius is too small for its ends", "give a larger R, or I, J, K"),
        35 => ("the arc has no I, J or K in its plane", "check G17, G18, G19 and the centre"),
        36 => ("a word has no use on this line", "take it out"),
        37 => ("G43.1 is for Z alone", "take the other axes out"),
        38 => ("the tool number is above 255", "use T0 to T255"),
        _ => {
            ("a number that GRBL 1.1 does not have", "look it up in the manual of your controller")
        }
    }
}

/// What the number after `ALARM:` means, and the cure.
pub fn alarm(code: u16) -> (&'static str, &'static str) {
    match code {
        1 => (
            "a limit switch was hit, or noise looked like it; the position is lost",
            "free the axis, check the switches' cables, home again and set the zero",
        ),
        2 => (
            "the program leads out of the travel; the position is kept",
            "check the work zero against the program's size",
        ),
        3 => ("a reset came while it moved; the position is lost", "home, or set the zero again"),
        4 => (
            "the probe touched before it moved, or its cable is open",
            "check the probe's clip and cable",
        ),
        5 => ("the probe met nothing on its way", "move the plate nearer, or probe further"),
        6 => ("a reset came while homing", "home again"),
        7 => ("the door was opened while homing", "close the door and home again"),
        8 => (
            "homing did not free a limit switch",
            "raise the pull-off ($27) or check the switch for dirt",
        ),
        9 => (
            "homing met no limit switch",
            "check that travel ($130-$132) is no smaller than the machine, and the switches",
        ),
        10 => (
            "homing did not find the second switch of a dual axis",
            "square the axis and home again",
        ),
        _ => {
            ("a number that GRBL 1.1 does not have", "look it up in the manual of your controller")
        }
    }
}
