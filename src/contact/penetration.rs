//! Penetration of single nodes, which the mean gaps of the contact conditions do not see.
use super::{
    Surface,
    search::Search,
    vector::{dot, sub},
};
use crate::tolerances::COORDINATES;

/// Largest depth, m, of a node of `own` in what `other` bounds, along the node's normal; `offset`, m, is added to every gap.
///
/// What lies deeper than a facet is large is no penetration of single nodes: contact conditions see it, or the surface
/// faces another part of the other one.
pub fn deepest_node(own: &Surface, other: &Surface, offset: f64) -> f64 {
    let search = Search::new(other);
    let depth = |(x, normal): (&[f64; 3], &[f64; 3])| -> Option<f64> {
        let hit = search.intersection(x, normal)?;
        let eta = hit.shape[1] - hit.shape[0];
        let of_curve = other.distance_to_curve(hit.facet, x, normal, eta);
        let gap = of_curve.unwrap_or_else(|| dot(normal, &sub(&hit.point, x))) + offset;
        let size = other.facet_size(hit.facet);
        Some(-gap).filter(|d| *d > COORDINATES * size && *d < size)
    };
    std::iter::zip(&own.points, &own.normals).filter_map(depth).fold(0.0, crate::vector::larger)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::testing::{circle, equal, placed};

    #[test]
    fn a_spike_between_the_nodes_is_seen_from_its_own_side() {
        // A roof whose ridge lies 0.1 above the middle of a facet.
        let spike = Surface::rigid_polyline(&[[3.0, -1.9], [0.5, 0.1], [-2.0, -1.9]]);
        let points: Vec<[f64; 2]> = equal(4, -2.0, 2.0).into_iter().map(|x| [x, 0.0]).collect();
        let flat = Surface::rigid_polyline(&points);
        assert!((deepest_node(&spike, &flat, 0.0) - 0.1).abs() < 1e-12);
        assert_eq!(deepest_node(&spike, &flat, 0.11), 0.0);
    }

    #[test]
    fn discs_that_touch_do_not_penetrate() {
        // Normals of far nodes meet nothing, or pass the nearest point of the other disc at a distance.
        for (n, m) in [(40, 30), (33, 64), (16, 16)] {
            for quadratic in [false, true] {
                let upper = placed(&circle(n, 1.0, quadratic, false, 0.0), 0.0, [0.0, 1.0]);
                let lower = placed(&circle(m, 1.0, quadratic, false, 0.3), 0.0, [0.0, -1.0]);
                assert_eq!(deepest_node(&upper, &lower, 0.0), 0.0, "{n} {m}");
                assert_eq!(deepest_node(&lower, &upper, 0.0), 0.0, "{n} {m}");
                assert!(deepest_node(&upper, &lower, -0.02) > 0.01, "{n} {m}");
            }
        }
    }

    #[test]
    fn polygons_in_a_bore_touch_by_their_curves() {
        let (disc, bore) = (circle(16, 1.0, false, false, 0.0), circle(23, 1.001, false, true, 0.1));
        assert_eq!(deepest_node(&disc, &bore, 0.0), 0.0);
        assert!((deepest_node(&disc, &bore, -0.002) - 0.001).abs() < 2e-5);
    }
}
