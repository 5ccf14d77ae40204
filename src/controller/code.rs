//! The numbers of `error:` and `ALARM:` (GRBL 1.1 `report.h`, `system.h`).

/// Why a line is refused: the number after `error:`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("error:{}", *self as u8)]
#[non_exhaustive]
#[repr(u8)]
#[allow(missing_docs, reason = "the names say what the firmware's numbers mean")]
pub enum Refusal {
    ExpectedLetter = 1,
    BadNumber = 2,
    BadStatement = 3,
    NegativeValue = 4,
    HomingOff = 5,
    ShortPulse = 6,
    EepromRead = 7,
    NotIdle = 8,
    Locked = 9,
    SoftLimitsNeedHoming = 10,
    LineOverflow = 11,
    DoorAjar = 13,
    JogBeyondTravel = 15,
    BadJog = 16,
    Unsupported = 20,
    ModalGroup = 21,
    NoFeed = 22,
    NotInteger = 23,
    TwoAxisCommands = 24,
    RepeatedWord = 25,
    NoAxisWords = 26,
    BadLineNumber = 27,
    MissingWord = 28,
    BadCoordinateSystem = 29,
    G53NeedsMotion = 30,
    AxisWordsExist = 31,
    NoAxisInPlane = 32,
    BadTarget = 33,
    BadRadius = 34,
    NoOffsetInPlane = 35,
    UnusedWords = 36,
    ToolLengthAxis = 37,
    BadTool = 38,
}

/// Why motion was stopped: the number after `ALARM:`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Alarm {
    HardLimit = 1,
    SoftLimit = 2,
    AbortInMotion = 3,
    ProbeInitial = 4,
    ProbeContact = 5,
    HomingReset = 6,
    HomingDoor = 7,
    HomingPullOff = 8,
    HomingApproach = 9,
}

impl Alarm {
    /// After these the controller hears nothing but a reset.
    pub(super) fn is_critical(self) -> bool {
        matches!(self, Self::HardLimit | Self::SoftLimit)
    }
}
