//! What the generators can make.

/// Subdivision of one direction of a structured mesh: strictly increasing relative or absolute positions of
/// the cell boundaries (corner nodes), first to last.
#[derive(Debug, Clone, PartialEq)]
pub struct Grading {
    /// Positions of the corner nodes, increasing. For a rectangle they are coordinates in m, for a block or the
    /// directions of a ring or half disc as the variant of [`Shape`] says.
    pub at: Vec<f64>,
}

/// Built-in geometries. All elements are counter-clockwise.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Axis-parallel rectangle; surfaces `left`, `right`, `bottom`, `top`.
    Rectangle {
        /// x of the corner nodes, m.
        x: Grading,
        /// y of the corner nodes, m.
        y: Grading,
    },
    /// Four corners (bottom-left, bottom-right, top-right, top-left), mapped by a Coons patch; an edge is straight or
    /// a circular arc. Surfaces `left`, `right`, `bottom`, `top`.
    Block {
        /// The corners, counter-clockwise from bottom-left, m.
        corners: [[f64; 2]; 4],
        /// Centre of the arc of `bottom`, `right`, `top`, `left` where it is one, m.
        arcs: [Option<[f64; 2]>; 4],
        /// Along bottom and top: 0 to 1 (fraction of the x extent on an arc edge is NOT used: fraction of arc length).
        u: Grading,
        /// From bottom to top: 0 to 1.
        v: Grading,
    },
    /// Ring sector; surfaces `inner`, `outer`, `start`, `end` (the last two absent on a full ring).
    Ring {
        /// Centre, m.
        center: [f64; 2],
        /// Radii of the corner nodes, m.
        radius: Grading,
        /// Angles of the corner nodes, radians, counter-clockwise from x.
        angle: Grading,
    },
    /// Half disc below (or above) its mid-plane: a core block and three outer blocks; surfaces `flat` (the mid-plane) and `arc`.
    HalfDisc {
        /// Centre of the mid-plane, m.
        center: [f64; 2],
        /// Radius, m.
        radius: f64,
        /// True: the arc points up (y >= center), false: down.
        up: bool,
        /// Along the arc: angle from the arc's lowest (highest) point, radians, over the middle block, symmetric
        /// about 0, strictly inside (-pi/2, pi/2).
        angle: Grading,
        /// From the arc inwards: depth below the arc as a fraction of the radius, 0 first, last < 1.
        depth: Grading,
        /// Cells of the core between mid-plane and outer block.
        core: usize,
    },
    /// Full disc: a square core and four outer blocks; surface `arc`.
    Disc {
        /// Centre, m.
        center: [f64; 2],
        /// Radius, m.
        radius: f64,
        /// Cells along each quarter of the rim.
        quarter: usize,
        /// From the rim inwards: depth as a fraction of the radius, 0 first, last < 1.
        depth: Grading,
    },
}
