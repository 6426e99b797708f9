//! Friction in the paper's alternation.
//!
//! All nodes that touch stick at first: tangential displacements of both sides are brought to agree as normal ones are (39). After the
//! force correction (22) nodes whose tangential force is beyond mu p (37) slide: the force is mu p against the slip (40), and
//! their tangential displacements are let go, until the slip would go along with the force: then they stick again. So after the
//! force step of an alternation in which no node changed, the law holds at every node but for what the surfaces disagree by.
use super::{ActiveSet, Alternation, Respond, Touch, frictional::Node};
use crate::{
    contact::Law,
    tolerances::THRESHOLD,
    vector::{larger, worst},
};

impl<B: Respond> ActiveSet<'_, '_, B> {
    /// The nodes of this rank, if any pair of any rank has tangential forces; bonded ones touch.
    pub(super) fn rubbing_nodes(&mut self) -> Option<Vec<Node>> {
        if !self.limits.friction {
            return None;
        }
        let mut nodes = Vec::new();
        for (rows, range) in std::iter::zip(self.rows, &self.coupling.ranges) {
            let n = rows.n_normal();
            let of_row = |k: usize| {
                let [friction, shear] = rows.bounds(k);
                Node {
                    normal: range.start + k,
                    tangential: rows.law.is_frictional().then_some(range.start + n + k),
                    friction,
                    shear,
                    bonded: rows.law == Law::Tied,
                    held: false,
                }
            };
            nodes.extend((0..range.len().min(n)).map(of_row));
        }
        self.touch = vec![Touch::Open; self.coupling.n_rows];
        nodes.iter().filter(|node| node.bonded).for_each(|node| self.put(node, Touch::Stick));
        Some(nodes)
    }

    /// Lets a node do this.
    fn put(&mut self, node: &Node, touch: Touch) {
        (self.touch[node.normal], self.active[node.normal]) = (touch, touch != Touch::Open);
        if let Some(t) = node.tangential {
            (self.touch[t], self.active[t]) = (touch, touch == Touch::Stick);
        }
    }
}

impl<B: Respond> Alternation<'_, '_, '_, B> {
    /// Nodes begin as `known`, end by end, says; those without pressure are open. The forces are the rows'.
    pub(super) fn begin_as(&mut self, known: &[Vec<Touch>]) {
        let ranges = self.rows.coupling.ranges.clone();
        for node in self.nodes.iter().flatten() {
            let end = ranges.iter().zip(known).find(|(range, _)| range.contains(&node.normal));
            let touch = end.and_then(|(range, known)| known.get(node.normal - range.start).copied());
            let touch = match (touch, self.rows.force[node.normal] > 0.0) {
                _ if node.bonded => Touch::Stick,
                (Some(touch), true) if touch.slips().is_some() && node.friction.is_finite() => touch,
                (_, true) => Touch::Stick,
                (_, false) => Touch::Open,
            };
            self.rows.put(node, touch);
        }
        self.limit_forces();
    }

    /// Nodes that stick and whose tangential force is beyond its bound (37) slide; those that slide have that of (40), open ones
    /// none. Returns the nodes that began to slide. Collective on the roots.
    pub(super) fn limit_forces(&mut self) -> Vec<usize> {
        let Some(nodes) = &self.nodes else { return Vec::new() };
        let threshold = THRESHOLD * self.rows.largest(&self.rows.force);
        let mut changed = Vec::new();
        for node in nodes {
            if !self.rows.active[node.normal] {
                self.rows.put(node, Touch::Open);
            }
            let Some(t) = node.tangential else { continue };
            let bound = node.bound(self.rows.force[node.normal]);
            let force = self.rows.force[t];
            if self.rows.active[t] && force.abs() > bound + threshold {
                self.rows.put(node, if force > 0.0 { Touch::Forwards } else { Touch::Backwards });
                changed.push(node.normal);
            }
            match self.rows.touch[t] {
                Touch::Stick => {}
                Touch::Open => self.rows.force[t] = 0.0,
                touch => self.rows.force[t] = touch.slips().unwrap_or(0.0) * bound,
            }
        }
        changed
    }

    /// Nodes that have entered the contact stick, and so do those whose slip goes along with the force; returns these. A slip
    /// that is smaller than what the surfaces disagree by says nothing: nodes at the end of a sliding zone would change for ever
    /// on the way. It is within the tolerance once the disagreement is. Collective on the roots.
    pub(super) fn stick(&mut self) -> Vec<usize> {
        let Some(nodes) = &self.nodes else { return Vec::new() };
        let threshold = larger(self.rows.gap_threshold(), self.largest_jump());
        let mut changed = Vec::new();
        for node in nodes {
            if self.rows.active[node.normal] && self.rows.touch[node.normal] == Touch::Open {
                self.rows.put(node, Touch::Stick);
            }
            let (Some(t), Some(sign)) = (node.tangential, self.rows.touch[node.normal].slips()) else {
                continue;
            };
            if sign * self.rows.gap[t] > threshold {
                self.rows.put(node, Touch::Stick);
                changed.push(node.normal);
            }
        }
        changed
    }

    /// Largest gap at rows whose surfaces were to agree, m. Collective on the roots.
    fn largest_jump(&self) -> f64 {
        let rows = &self.rows;
        let agree = |j: &usize| rows.active[*j] && rows.touch[*j] != Touch::Open;
        let jumps = (0..rows.coupling.n_rows).filter(agree).map(|j| rows.gap[j].abs());
        rows.coupling.exchange.max(&[worst(jumps)])[0]
    }

    /// Values on the rows of a node with a tangential force as the length of the vector that they are: a magnitude is that of the
    /// whole force or displacement, not of its components.
    pub(super) fn lengths(&self, mut values: [Vec<f64>; 2]) -> [Vec<f64>; 2] {
        let sliding = self.nodes.iter().flatten().filter_map(|node| Some((node.normal, node.tangential?)));
        for (n, t) in sliding {
            for values in &mut values {
                let length = values[n].hypot(values[t]);
                (values[n], values[t]) = (length, length);
            }
        }
        values
    }

    /// True if a row's force may be compressive only: neither along the surfaces nor of bonded ones.
    pub(super) fn unilateral(&self) -> Vec<bool> {
        let mut unilateral = vec![true; self.rows.coupling.n];
        for node in self.nodes.iter().flatten() {
            unilateral[node.normal] = !node.bonded;
            node.tangential.into_iter().for_each(|t| unilateral[t] = false);
        }
        unilateral
    }
}
