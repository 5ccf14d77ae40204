//! A small job and small reliefs for tests.

use crate::geom::{DVec2, DVec3, Grid, Heightfield, Tolerance};
use crate::job::{
    ArtworkSpec, Background, Combine, CutterShape, CutterSpec, Fit, Follow, Job, LayerSpec, Limits,
    Machine, Milling, Operation, OperationKind, Origin, Pattern, Place, Profile, ReliefSpec,
    Selector, Stepover, Stock, SurfaceSpec, TraceSpec, Within, Wood,
};
use proptest::prelude::{Strategy, any, prop};

/// A job on a stock of this size with these operations and a shapeoko-like machine.
pub(crate) fn job(
    width_mm: f64,
    height_mm: f64,
    thickness_mm: f64,
    pitch_mm: f64,
    operations: Vec<Operation>,
) -> Job {
    let wood = Wood {
        name: "beech".into(),
        title: "Beech".into(),
        flat_chip_load_mm: vec![(6.0, 0.04)],
        ball_chip_load_mm: vec![(3.0, 0.02)],
        stepdown_per_diameter: 0.3,
    };
    let file = "test.svg".to_owned();
    let layer = LayerSpec {
        name: "all".into(),
        select: Selector::All,
        surface: SurfaceSpec::Profile { profile: Profile::Round, radius_mm: None },
        base_mm: 0.0,
        height_mm: 3.0,
        offset_mm: 0.0,
        combine: Combine::Max,
        blend_mm: 0.0,
        feather_mm: 0.0,
        draft_rad: 0.0,
        slope_cap: f64::INFINITY,
        union: false,
        smooth: None,
        visible: false,
        edits: None,
    };
    Job {
        title: "Test".into(),
        machine: Machine {
            name: "router".into(),
            title: "Router".into(),
            travel_mm: DVec3::new(425.0, 465.0, 80.0),
            steps_per_mm: DVec3::splat(250.0),
            max_rate_mm_per_min: DVec3::new(5000.0, 5000.0, 2500.0),
            acceleration_mm_per_s2: DVec3::splat(400.0),
            junction_deviation_mm: 0.01,
            arc_tolerance_mm: 0.002,
            spindle_min_rpm: 8000.0,
            spindle_max_rpm: 24000.0,
            spindle_dwell_s: 3.0,
        },
        stock: Stock {
            width_mm,
            height_mm,
            thickness_mm,
            wood,
            grain_rad: 0.0,
            origin: Origin::LowerLeft,
        },
        artwork: ArtworkSpec {
            file,
            fit: Fit::Own,
            at: Place::Center,
            font_dirs: Vec::new(),
            dpi: None,
            trace: TraceSpec::default(),
        },
        relief: ReliefSpec { pitch_mm, depth_mm: 5.0, background: Background::Clear },
        layers: vec![layer],
        groups: vec![],
        operations,
        keep_outs: Vec::new(),
        tolerance: Tolerance::default(),
        safe_z_mm: 5.0,
        clearance_mm: 1.0,
        ramp_rad: 5.0_f64.to_radians(),
        limits: Limits::default(),
        strict: false,
        artwork_unit_mm: 1.0,
        artwork_lower_left_mm: DVec2::ZERO,
        artwork_size_mm: DVec2::new(width_mm, height_mm),
        notes: Vec::new(),
    }
}

/// A cutter of this shape and diameter.
pub(crate) fn cutter(shape: CutterShape, diameter_mm: f64) -> CutterSpec {
    CutterSpec {
        name: format!("{}-{diameter_mm}", shape.word()),
        shape,
        diameter_mm,
        flutes: 2,
        flute_mm: 22.0,
        shank_mm: diameter_mm,
        stickout_mm: 35.0,
        holder_mm: 30.0,
    }
}

/// A roughing operation along x.
pub(crate) fn rough(cutter: CutterSpec, leave_mm: f64, stepdown_mm: f64) -> Operation {
    let stepover_mm = 0.4 * cutter.diameter_mm;
    Operation {
        kind: OperationKind::Rough {
            leave_mm,
            stepdown_mm,
            stepover_mm,
            pattern: Pattern::Contour { milling: Milling::Climb },
        },
        cutter,
        feed_mm_per_min: 1500.0,
        plunge_mm_per_min: 375.0,
        spindle_rpm: 18000.0,
        within: Within::Stock,
    }
}

/// A raster operation.
pub(crate) fn raster(cutter: CutterSpec, stepover: Stepover, angle_deg: f64) -> Operation {
    Operation {
        kind: OperationKind::Raster { stepover, angle_rad: angle_deg.to_radians() },
        cutter,
        feed_mm_per_min: 1200.0,
        plunge_mm_per_min: 300.0,
        spindle_rpm: 18000.0,
        within: Within::Stock,
    }
}

/// A finishing operation with first passes along x.
pub(crate) fn finish(cutter: CutterSpec, scallop_mm: f64) -> Operation {
    let kind = OperationKind::Finish { scallop_mm, follow: Follow::Direction, angle_rad: 0.0 };
    Operation { kind, ..raster(cutter, Stepover::Plan(1.0), 0.0) }
}

/// Waterlines on ground steeper than an angle.
pub(crate) fn contour(cutter: CutterSpec, scallop_mm: f64, steeper_than_deg: f64) -> Operation {
    let steeper_than_rad = steeper_than_deg.to_radians();
    let kind = OperationKind::Contour { scallop_mm, steeper_than_rad, milling: Milling::Climb };
    Operation { kind, ..raster(cutter, Stepover::Plan(1.0), 0.0) }
}

/// A round bump or tower: centre, radius, height above the ground (both mm), and whether its side is a wall.
#[derive(Debug, Clone)]
pub(crate) struct Bump {
    pub(crate) at: DVec2,
    pub(crate) radius_mm: f64,
    pub(crate) height_mm: f64,
    pub(crate) wall: bool,
}

/// Bumps on a ground `depth_mm` below the stock's top, cut off at the top, within a frame of untouched stock.
pub(crate) fn relief(job: &Job, depth_mm: f64, frame_mm: f64, bumps: &[Bump]) -> Heightfield {
    let (stock, pitch) = (&job.stock, job.relief.pitch_mm);
    let rect = stock.bounds();
    let grid = Grid::covering(rect.min, stock.width_mm, stock.height_mm, pitch).unwrap();
    Heightfield::from_fn(grid, |p| {
        let rim = (p - rect.min).min(rect.max - p).min_element();
        if rim < frame_mm {
            return 0.0;
        }
        let rise = |b: &Bump| {
            let t = p.distance(b.at) / b.radius_mm;
            let share = if b.wall { f64::from(u8::from(t < 1.0)) } else { libm::exp(-t * t) };
            b.height_mm * share
        };
        (bumps.iter().map(rise).fold(0.0, f64::max) - depth_mm).min(0.0)
    })
}

/// A few bumps anywhere on a stock of this size, up to `depth` high, mm.
pub(crate) fn bumps(size: DVec2, depth: f64) -> impl Strategy<Value = Vec<Bump>> {
    let bump = (0.0..=1.0, 0.0..=1.0, 0.4..4.0f64, 0.2..1.0f64, any::<bool>()).prop_map(
        move |(u, v, radius_mm, h, wall)| Bump {
            at: size * DVec2::new(u, v),
            radius_mm,
            height_mm: h * depth,
            wall,
        },
    );
    prop::collection::vec(bump, 1..5)
}
