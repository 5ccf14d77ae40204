//! What can be wrong with a program, each kind once a program with its worst place.

use super::Manners;
use crate::geom::DVec3;

/// What is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum FailureKind {
    /// The carved surface lies deeper below the target than allowed.
    Gouge,
    /// A rapid runs through wood.
    RapidInWood,
    /// A feed move in wood goes down faster than the operation allows.
    Plunge,
    /// Wood stands higher above the tip than the flutes reach.
    Flute,
    /// The shank runs into wood.
    Shank,
    /// The collet nut runs into wood.
    Holder,
    /// The program is larger than the machine.
    Travel,
    /// With the zero where it is, the program leaves the machine's travel.
    SoftLimit,
    /// A feed that the machine cannot run, or one in wood that no operation of the cutter asks for.
    Feed,
    /// A spindle speed that the spindle does not have, or that no operation of the cutter asks for.
    SpindleSpeed,
    /// The tip is in wood and the spindle does not turn.
    SpindleOff,
    /// The spindle is started backwards (M4).
    SpindleReversed,
    /// The tip comes into wood before the spindle had time to start.
    NoDwell,
    /// The tip goes below the stock.
    ThroughBottom,
    /// The program moves sideways before it has set its height, or sets it first below safe Z.
    BlindStart,
    /// A rapid moves sideways below safe Z over ground that is not carved yet, or too close to the wood.
    LowRapid,
    /// The tip goes below the stock's top beside the stock, where clamps are.
    OutsideStock,
    /// The tool comes into a keep-out.
    KeepOut,
    /// The program ends below safe Z, or the spindle stops while the tip is below the stock's top.
    EndInWood,
    /// The program does not end with the spindle off and M2 or M30.
    NoEnd,
    /// A move cuts where more wood stands above the tip than the job's limit.
    Engagement,
    /// A chip is thicker than the job's limit.
    ChipLoad,
    /// Too much wood is left where a cutter reaches (a strict job, or one with a limit).
    Leftover,
    /// The replay and the second oracle disagree: a fault of this program, not of the G-code.
    Oracles,
}

impl FailureKind {
    /// False for what is only unlike our own programs: it may be meant, and harms nothing by itself.
    fn does_harm(self) -> bool {
        !matches!(
            self,
            Self::NoDwell
                | Self::BlindStart
                | Self::LowRapid
                | Self::OutsideStock
                | Self::NoEnd
                | Self::SpindleSpeed
        )
    }
}

/// Something wrong with a program, at its worst place.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Failure {
    /// What is wrong.
    pub kind: FailureKind,
    /// Name of the program; empty when no single program is to blame.
    pub program: String,
    /// Line of the program, from 1; 0 when no single line is to blame.
    pub line: u32,
    /// Where, work coordinates, mm.
    pub at: DVec3,
    /// How much: mm, mm/min, 1/min or s, as the kind asks.
    pub amount: f64,
    /// How much is allowed.
    pub limit: f64,
    /// How many moves (or nodes) have this fault; this is the worst.
    pub count: usize,
    /// All of it as a sentence for the person at the machine.
    pub sentence: String,
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.sentence)
    }
}

/// One finding, before it has become a failure.
#[derive(Debug, Clone, Copy)]
pub(super) struct Finding<'a> {
    pub(super) kind: FailureKind,
    pub(super) program: &'a str,
    pub(super) line: u32,
    pub(super) at: DVec3,
    pub(super) amount: f64,
    pub(super) limit: f64,
}

/// All findings so far, the worst of each kind and program.
#[derive(Debug, Default)]
pub(super) struct Ledger(Vec<Failure>);

impl Ledger {
    /// Notes `count` findings of one kind, of which this is the worst.
    pub(super) fn note(&mut self, f: Finding, count: usize) {
        let known = self.0.iter_mut().find(|k| k.kind == f.kind && k.program == f.program);
        match known {
            Some(k) => {
                k.count += count;
                if f.amount > k.amount {
                    (k.line, k.at, k.amount, k.limit) = (f.line, f.at, f.amount, f.limit);
                }
            }
            None => self.0.push(Failure {
                kind: f.kind,
                program: f.program.to_owned(),
                line: f.line,
                at: f.at,
                amount: f.amount,
                limit: f.limit,
                count,
                sentence: String::new(),
            }),
        }
    }

    /// The failures in the order found, with their sentences, and those that are remarks only by these manners.
    pub(super) fn into_failures(mut self, manners: Manners) -> (Vec<Failure>, Vec<Failure>) {
        for f in &mut self.0 {
            f.sentence = sentence(f);
        }
        self.0.into_iter().partition(|f| manners == Manners::Own || f.kind.does_harm())
    }
}

fn sentence(f: &Failure) -> String {
    let (a, l) = (f.amount, f.limit);
    let what = match f.kind {
        FailureKind::Gouge => format!(
            "cuts {a:.3} mm into the target ({l:.3} allowed); the path is wrong, do not run it"
        ),
        FailureKind::RapidInWood => format!("a rapid runs {a:.2} mm deep through wood; retract before it"),
        FailureKind::Plunge => format!(
            "goes down into wood at {a:.0} mm/min ({l:.0} allowed for this cutter); lower the feed"
        ),
        FailureKind::Flute => format!(
            "{a:.2} mm of wood stand above the tip but the flutes are {l:.2} mm long; \
             take a longer cutter or clear the wood in levels first"
        ),
        FailureKind::Shank => format!(
            "the shank rubs {a:.2} mm deep in wood; take a cutter with a longer flute or a thinner shank"
        ),
        FailureKind::Holder => {
            format!("the collet nut runs {a:.2} mm deep into wood; let the cutter stick out further")
        }
        FailureKind::Travel => {
            format!("needs {a:.2} mm of travel along one axis, the machine has {l:.2}; carve a smaller piece")
        }
        FailureKind::SoftLimit => format!(
            "leaves the machine's travel by {a:.2} mm with the zero where it is; move the stock or set the zero elsewhere"
        ),
        FailureKind::Feed => {
            format!("a feed of {a:.0} mm/min, the machine and the job's operations with this cutter allow {l:.0}; lower the feed")
        }
        FailureKind::SpindleSpeed => {
            format!("a spindle speed of {a:.0} 1/min, the spindle and the job's operations with this cutter ask for {l:.0}; change S")
        }
        FailureKind::SpindleOff => {
            format!("cuts {a:.2} mm deep while the spindle is off; put M3 with a speed before it")
        }
        FailureKind::NoDwell => format!(
            "enters wood {a:.1} s short of the {l:.1} s that the spindle needs to start; put G4 after M3"
        ),
        FailureKind::ThroughBottom => format!(
            "the tip goes {a:.2} mm below the stock's underside; use thicker stock or a shallower relief"
        ),
        FailureKind::SpindleReversed => {
            "M4 turns the cutter backwards, which burns wood and breaks cutters; write M3".to_owned()
        }
        FailureKind::BlindStart => {
            "moves in X or Y before it has set Z, or sets Z below safe Z first, wherever the tip stands; \
             begin with G0 Z at safe height"
                .to_owned()
        }
        FailureKind::LowRapid => {
            format!(
                "a rapid moves sideways {a:.2} mm below safe Z ({l:.2}), over ground that is not carved yet or closer to \
                 the wood than clearance_mm; retract before it"
            )
        }
        FailureKind::OutsideStock => format!(
            "the tip goes {a:.2} mm outside the stock's rectangle below its top, where clamps are; \
             keep the path over the stock"
        ),
        FailureKind::KeepOut => format!(
            "the tool comes {a:.2} mm into a keep-out, below its top at Z {l:.2}; keep the path away or move the clamp"
        ),
        FailureKind::EndInWood => format!(
            "the program ends or stops the spindle with the tip {a:.2} mm below Z {l:.2}; \
             retract with G0 Z to safe Z before M5"
        ),
        FailureKind::NoEnd => {
            "does not end with M5 and M2 or M30; it may be cut short, so write it again".to_owned()
        }
        FailureKind::Engagement => format!(
            "cuts where {a:.2} mm of wood stand above the tip (the limit is {l:.2}); take less in one pass"
        ),
        FailureKind::ChipLoad => format!(
            "chips of {a:.3} mm a tooth (the limit is {l:.3}); lower the feed, raise the spindle speed or \
             take less in one pass"
        ),
        FailureKind::Leftover => format!(
            "{a:.3} mm of wood are left above what the cutters reach ({l:.3} allowed); \
             take a smaller stepover or add a finishing pass"
        ),
        FailureKind::Oracles => format!(
            "the two oracles disagree by {a:.4} mm ({l:.4} allowed): a fault of relievo itself; \
             do not run the program and report it with the job"
        ),
    };
    let place = format!("at X{:.3} Y{:.3} Z{:.3}", f.at.x, f.at.y, f.at.z);
    let head = match (f.program.is_empty(), f.line) {
        (true, _) => String::new(),
        (false, 0) => format!("{}: ", f.program),
        (false, line) => format!("{} line {line}: ", f.program),
    };
    let more = match f.count {
        0 | 1 => String::new(),
        n => format!(" (the worst of {n} such places)"),
    };
    format!("{head}{place}: {what}{more}")
}
