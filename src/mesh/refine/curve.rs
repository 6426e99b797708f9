//! Curves that sides of cells stand for.

/// The curve between the two end nodes of a boundary side, where it is not the side's own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Curve {
    /// Of a circle, the shorter way round.
    Arc {
        /// Centre, m.
        center: [f64; 2],
    },
    /// Cubic Bezier curve; its inner control points, the first next to the node of the smaller number, m.
    Cubic {
        /// The points.
        control: [[f64; 2]; 2],
    },
}

/// Middle of two points; the same bits whichever comes first.
pub(super) fn middle(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]
}

impl Curve {
    /// The curve's middle, and its halves, the second from the middle on. `a`, `b`: its ends, in its own order.
    pub(super) fn halves(&self, a: [f64; 2], b: [f64; 2]) -> ([f64; 2], [Curve; 2]) {
        match *self {
            Curve::Arc { center: c } => {
                let (p, q) = ([a[0] - c[0], a[1] - c[1]], [b[0] - c[0], b[1] - c[1]]);
                let radius = 0.5 * (p[0].hypot(p[1]) + q[0].hypot(q[1]));
                let bisector = [p[0] + q[0], p[1] + q[1]];
                let length = bisector[0].hypot(bisector[1]);
                let mid = [0, 1].map(|d| c[d] + radius * (bisector[d] / length));
                (mid, [*self; 2])
            }
            Curve::Cubic { control: [p, q] } => {
                // De Casteljau at the middle.
                let (first, inner, last) = (middle(a, p), middle(p, q), middle(q, b));
                let (left, right) = (middle(first, inner), middle(inner, last));
                let halves = [[first, left], [right, last]].map(|control| Curve::Cubic { control });
                (middle(left, right), halves)
            }
        }
    }

    /// The same curve in the other direction.
    pub(super) fn reversed(self) -> Curve {
        match self {
            Curve::Arc { .. } => self,
            Curve::Cubic { control: [p, q] } => Curve::Cubic { control: [q, p] },
        }
    }

    /// The curve between its ends' images under a rotation (cosine, sine) and a translation.
    pub(in crate::mesh) fn moved(self, map: impl Fn([f64; 2]) -> [f64; 2]) -> Curve {
        match self {
            Curve::Arc { center } => Curve::Arc { center: map(center) },
            Curve::Cubic { control } => Curve::Cubic { control: control.map(map) },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_of_an_arc_lie_on_its_circle() {
        let (c, r) = ([0.3, -0.2], 2.5);
        let at = |t: f64| [c[0] + r * t.cos(), c[1] + r * t.sin()];
        let (mid, halves) = Curve::Arc { center: c }.halves(at(0.2), at(1.4));
        assert!((mid[0] - at(0.8)[0]).hypot(mid[1] - at(0.8)[1]) < 1e-15 * 8.0);
        let (quarter, _) = halves[1].halves(mid, at(1.4));
        assert!((quarter[0] - at(1.1)[0]).hypot(quarter[1] - at(1.1)[1]) < 1e-15 * 8.0);
    }

    #[test]
    fn halves_of_a_cubic_are_the_cubic() {
        let p = [[0.0, 0.0], [1.0, 2.0], [3.0, 1.0], [4.0, -1.0]];
        let at = |t: f64| {
            let s = 1.0 - t;
            let w = [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t];
            [0, 1].map(|d| (0..4).map(|i| w[i] * p[i][d]).sum::<f64>())
        };
        let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-14;
        let curve = Curve::Cubic { control: [p[1], p[2]] };
        let (mid, [left, right]) = curve.halves(p[0], p[3]);
        assert!(near(mid, at(0.5)));
        assert!(near(left.halves(p[0], mid).0, at(0.25)) && near(right.halves(mid, p[3]).0, at(0.75)));
        let back = curve.reversed().halves(p[3], p[0]);
        assert!(near(back.0, mid) && back.1[0] == right.reversed());
    }
}
