//! Which ranks work on which bodies.
use std::ops::Range;

/// A rank group: its ranks in the world and the bodies it owns.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Share {
    /// World ranks.
    pub ranks: Range<usize>,
    /// Body indices, increasing.
    pub bodies: Vec<usize>,
}

/// Deals `ranks` ranks to bodies of the given costs (dofs).
///
/// With at least as many ranks as bodies every body has its own group, and each further rank goes to the body with the
/// largest cost per rank. With fewer ranks every rank is a group, and each body, costliest first, goes to the rank
/// with the least to do. Pure and deterministic: every rank computes the same.
pub fn deal(costs: &[usize], ranks: usize) -> Vec<Share> {
    let n = costs.len();
    let mut sizes = vec![1; ranks.min(n)];
    let mut bodies: Vec<Vec<usize>> = vec![Vec::new(); ranks.min(n)];
    if ranks >= n {
        for _ in n..ranks {
            let load = |i: usize| costs[i] as f64 / sizes[i] as f64;
            let busiest = (0..n).fold(0, |best, i| if load(i) > load(best) { i } else { best });
            sizes[busiest] += 1;
        }
        (0..n).for_each(|i| bodies[i].push(i));
    } else {
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by_key(|&i| std::cmp::Reverse(costs[i]));
        let mut loads = vec![0; ranks];
        for i in order {
            let idle = (0..ranks).min_by_key(|&r| loads[r]).expect("at least one rank");
            loads[idle] += costs[i].max(1);
            bodies[idle].push(i);
        }
        bodies.iter_mut().for_each(|b| b.sort_unstable());
    }
    let mut start = 0;
    sizes
        .into_iter()
        .zip(bodies)
        .map(|(size, bodies)| {
            start += size;
            Share { ranks: start - size..start, bodies }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_follow_cost() {
        let shares = deal(&[100, 300], 4);
        assert_eq!(shares[0], Share { ranks: 0..1, bodies: vec![0] });
        assert_eq!(shares[1], Share { ranks: 1..4, bodies: vec![1] });
    }

    #[test]
    fn bodies_share_a_rank() {
        let shares = deal(&[10, 50, 20, 30], 2);
        assert_eq!(shares[0].bodies, [0, 1]);
        assert_eq!(shares[1].bodies, [2, 3]);
    }

    #[test]
    fn every_rank_and_body_is_dealt_once() {
        for ranks in 1..9 {
            let shares = deal(&[7, 7, 3, 1], ranks);
            let dealt: Vec<usize> = shares.iter().flat_map(|s| s.ranks.clone()).collect();
            assert_eq!(dealt, (0..ranks).collect::<Vec<_>>());
            let mut bodies: Vec<usize> = shares.iter().flat_map(|s| s.bodies.clone()).collect();
            bodies.sort_unstable();
            assert_eq!(bodies, [0, 1, 2, 3]);
            assert!(shares.iter().all(|s| !s.bodies.is_empty()));
        }
    }
}
