//! Why crests cannot be carved: what, where, and what to change.

use crate::geom::DVec2;
use crate::surface::SubdivideError;

/// Why no surface can be raised over drawn crests.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CrestFault {
    /// Too few points.
    #[error(
        "{crest} has no length; draw it, or give it two different points or more (three for a closed one)"
    )]
    TooShort {
        /// The crest.
        crest: String,
    },
    /// A number that is none, a weight or a spacing that cannot be used.
    #[error("{crest}: {what} cannot be used; {cure}")]
    BadNumber {
        /// The crest.
        crest: String,
        /// The number.
        what: String,
        /// What to write.
        cure: &'static str,
    },
    /// A crest outside of the outline.
    #[error(
        "{crest} leaves the outline at {at:.2}; end it at least {room_mm:.2} mm inside, or draw the outline round it"
    )]
    Outside {
        /// The crest.
        crest: String,
        /// Where, mm.
        at: DVec2,
        /// How far inside its ends have to lie, mm.
        room_mm: f64,
    },
    /// No crest in a region.
    #[error(
        "no crest lies in the part at {at:.2}; draw one there, or put that part into a layer of its own"
    )]
    NoCrest {
        /// The middle of its box, mm.
        at: DVec2,
    },
    /// Heights that contradict each other where crests meet.
    #[error(
        "{one} is {one_mm:.3} mm high and {other} {other_mm:.3} mm where they meet at {at:.2}; give both the same \
         height there"
    )]
    Heights {
        /// A crest.
        one: String,
        /// Another.
        other: String,
        /// Height of the one, mm.
        one_mm: f64,
        /// Height of the other, mm.
        other_mm: f64,
        /// Where, mm.
        at: DVec2,
    },
    /// Too many arms.
    #[error(
        "{arms} arms of crests meet at {at:.2}, four can; move some of them along by a few millimetres"
    )]
    TooManyArms {
        /// How many.
        arms: usize,
        /// Where, mm.
        at: DVec2,
    },
    /// Arms that lie too close together where they meet.
    #[error(
        "crests meet at {at:.2} at an angle of {angle_deg:.0} degrees; let them meet at {least_deg:.0} degrees or more"
    )]
    TooAcute {
        /// Where, mm.
        at: DVec2,
        /// The angle, degrees.
        angle_deg: f64,
        /// What is needed, degrees.
        least_deg: f64,
    },
    /// A sharp crest meets a round one.
    #[error(
        "{one} is sharp and {other} is not where they meet at {at:.2}; make both sharp, or give both a width"
    )]
    SharpAndRound {
        /// The sharp one.
        one: String,
        /// The other.
        other: String,
        /// Where, mm.
        at: DVec2,
    },
    /// Weights or knots on a crest that meets others.
    #[error(
        "{crest} has weights or knots of its own and meets another crest at {at:.2}; leave them out, or part the crests"
    )]
    Weighted {
        /// The crest.
        crest: String,
        /// Where, mm.
        at: DVec2,
    },
    /// Strips or crests that meet what they should not.
    #[error(
        "there is no room for the strip of {crest} at {at:.2}: it meets the outline, itself or another crest; give it a \
         smaller half_width_mm, make it sharp, or move it"
    )]
    NoRoom {
        /// The crest.
        crest: String,
        /// Where, mm.
        at: DVec2,
    },
    /// A crest that bends so sharply that its strip folds.
    #[error(
        "{crest} bends too sharply at {at:.2} for a half width of {half_width_mm:.2} mm; give it a smaller \
         half_width_mm there, or draw a wider bend"
    )]
    Bend {
        /// The crest.
        crest: String,
        /// Where, mm.
        at: DVec2,
        /// Its half width there, mm.
        half_width_mm: f64,
    },
    /// The outline cannot be followed.
    #[error(
        "the outline at {at:.2} cannot be followed by the edges of the mesh; simplify it there, or give a smaller surface.edge_mm"
    )]
    Outline {
        /// Where, mm.
        at: DVec2,
    },
    /// The mesh cannot be refined.
    #[error("the mesh at {at:.2} cannot be refined: {why}")]
    Mesh {
        /// The middle of the region, mm.
        at: DVec2,
        /// Why.
        why: SubdivideError,
    },
}
