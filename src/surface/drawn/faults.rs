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
    /// A crest that shall end on the outline and does not reach it.
    #[error(
        "{crest} shall end on the outline, and is {gap_mm:.2} mm away from it at {at:.2}; draw it up to the outline or \
         across it, or leave ends = \"boundary\" out"
    )]
    OffOutline {
        /// The crest.
        crest: String,
        /// Its end, mm.
        at: DVec2,
        /// How far it is from the outline, mm.
        gap_mm: f64,
    },
    /// A crest whose end on the outline has another height.
    #[error(
        "{crest} ends on the outline at {at:.2} with a height of {height_mm:.3} mm, where the outline is {base_mm:.3} mm \
         high; end its heights with that, or let it end inside (ends = \"natural\")"
    )]
    EndHeight {
        /// The crest.
        crest: String,
        /// Its end, mm.
        at: DVec2,
        /// Its height there, mm.
        height_mm: f64,
        /// The outline's, mm.
        base_mm: f64,
    },
    /// A crest that hardly comes nearer to the outline where it ends on it.
    #[error(
        "{crest} ends on the outline at {at:.2} at an angle of {angle_deg:.0} degrees; let it meet the outline at \
         {least_deg:.0} degrees or more, or let it end inside (ends = \"natural\")"
    )]
    AlongOutline {
        /// The crest.
        crest: String,
        /// Its end, mm.
        at: DVec2,
        /// The angle, degrees.
        angle_deg: f64,
        /// What is needed, degrees.
        least_deg: f64,
    },
    /// A strip that ends on a corner of the outline.
    #[error(
        "{crest} ends on a corner of the outline at {at:.2}, where a strip has no room; make it sharp, end it beside the \
         corner, or let it end inside (ends = \"natural\")"
    )]
    AtCorner {
        /// The crest.
        crest: String,
        /// Its end, mm.
        at: DVec2,
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
        "crests meet or turn back at {at:.2} at an angle of {angle_deg:.0} degrees; let them meet at {least_deg:.0} degrees or \
         more, or make them sharp"
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
