//! Values at chosen nodes of a body, brought to the first rank of its group.
use super::Body;
use crate::parallel;
use mpi::{topology::SimpleCommunicator, traits::*};

impl Body {
    /// Displacements at chosen mesh nodes, m, from those at the owned nodes; on the first rank, empty elsewhere.
    /// Collective.
    pub fn at_nodes(&self, group: &SimpleCommunicator, owned: &[f64], nodes: &[u32]) -> Vec<[f64; 3]> {
        Observed::new(self, group, nodes).read(group, owned, self.dim())
    }

    /// Current temperatures at nodes of the mesh, K, on the group's first rank; `None`: it has none. Collective.
    pub fn temperatures_at(&self, group: &SimpleCommunicator, nodes: &[u32]) -> Option<Vec<f64>> {
        let owned = self.temperature.as_ref()?;
        let found = Observed::new(self, group, nodes).read(group, owned, 1);
        Some(found.into_iter().map(|[t, ..]| t).collect())
    }
}

/// Where the observed nodes are, and how their values reach the first rank.
struct Observed {
    /// This rank's owned observed nodes, by owned index, in the order of the observed nodes.
    mine: Vec<usize>,
    /// On the first rank: observed index of each value as gathered.
    order: Vec<usize>,
}

impl Observed {
    fn new(body: &Body, group: &SimpleCommunicator, observed: &[u32]) -> Observed {
        let global: Vec<u32> = observed.iter().map(|&o| body.numbering.new_of_old[o as usize]).collect();
        let owner: Vec<u32> = global.iter().map(|&g| body.numbering.owner(g)).collect();
        let rank = group.rank() as u32;
        let of_rank = |r: u32| (0..global.len()).filter(|&i| owner[i] == r).collect::<Vec<_>>();
        let mine = of_rank(rank).into_iter().map(|i| global[i] as usize - body.part.first_owned).collect();
        let order = if rank == 0 { (0..group.size() as u32).flat_map(of_rank).collect() } else { Vec::new() };
        Observed { mine, order }
    }

    /// Vectors at the observed nodes, on the first rank. Collective.
    fn read(&self, group: &SimpleCommunicator, owned: &[f64], dim: usize) -> Vec<[f64; 3]> {
        let mine: Vec<f64> = self.mine.iter().flat_map(|&i| owned[i * dim..(i + 1) * dim].to_vec()).collect();
        let all = parallel::gather(group, &mine);
        let mut out = vec![[0.0; 3]; self.order.len()];
        for (values, &i) in all.chunks_exact(dim).zip(&self.order) {
            out[i][..dim].copy_from_slice(values);
        }
        out
    }
}
