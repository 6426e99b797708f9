//! What one rank keeps of a mesh, and the numbering all ranks agree on.
use super::{Cell, Facet, Mesh, Slave};
use std::collections::BTreeMap;

/// Global node numbers in which each rank's nodes are consecutive.
///
/// Every rank computes it from the whole mesh, and gets the same.
#[derive(Debug, Clone, PartialEq)]
pub struct Numbering {
    /// Global number of each node of the [`Mesh`].
    pub new_of_old: Vec<u32>,
    /// Rank r owns the global numbers `offsets[r]..offsets[r + 1]`.
    pub offsets: Vec<u32>,
}

impl Numbering {
    /// A node belongs to the lowest rank among its cells' owners; a rank's nodes keep the mesh's order.
    pub fn new(mesh: &Mesh, owner_of_cell: &[u32], parts: usize) -> Self {
        let mut owner = vec![u32::MAX; mesh.points.len()];
        for (cell, &rank) in mesh.cells.iter().zip(owner_of_cell) {
            for &node in cell.nodes() {
                let node = &mut owner[node as usize];
                *node = rank.min(*node);
            }
        }
        // A node of no cell, which `check` refuses, goes to rank 0.
        owner.iter_mut().filter(|rank| **rank == u32::MAX).for_each(|rank| *rank = 0);
        let mut offsets = vec![0; parts + 1];
        owner.iter().for_each(|&rank| offsets[rank as usize + 1] += 1);
        for rank in 0..parts {
            offsets[rank + 1] += offsets[rank];
        }
        let mut next = offsets.clone();
        let new_of_old = owner
            .iter()
            .map(|&rank| {
                let next = &mut next[rank as usize];
                *next += 1;
                *next - 1
            })
            .collect();
        Numbering { new_of_old, offsets }
    }

    /// The rank that owns a global node.
    pub fn owner(&self, global: u32) -> u32 {
        (self.offsets.partition_point(|&offset| offset <= global) - 1) as u32
    }
}

/// One rank's share of a mesh: its cells, one layer of halo cells, and the global numbering.
#[derive(Debug, Clone)]
pub struct MeshPart {
    /// Number of space dimensions.
    pub dim: usize,
    /// Node coordinates, m: nodes owned by this rank, then the other nodes of its cells, then nodes of halo
    /// cells only; each group in the order of global numbers.
    pub points: Vec<[f64; 3]>,
    /// Global number of each node; see [`Numbering`].
    pub global: Vec<u32>,
    /// Number of the node in the [`Mesh`].
    pub original: Vec<u32>,
    /// How many nodes this rank owns.
    pub n_owned: usize,
    /// How many nodes its own cells have, owned or not; with the masters of those that hang.
    pub n_local: usize,
    /// Own cells, then halo cells: all others that touch a node of an own cell, and those with a slave of an owned
    /// master. Node numbers are local.
    pub cells: Vec<Cell>,
    /// How many cells are own.
    pub n_own_cells: usize,
    /// Number of the cell in the [`Mesh`].
    pub original_cells: Vec<u32>,
    /// Every named surface of the mesh, with its facets on own cells; possibly none.
    pub surfaces: BTreeMap<String, Vec<Facet>>,
    /// First global number this rank owns.
    pub first_owned: usize,
    /// Number of nodes of the whole mesh.
    pub n_global_nodes: usize,
    /// Number of cells of the whole mesh.
    pub n_global_cells: usize,
    /// Nodes of the part that hang, in local numbers and by them, with all their masters here: at least those of own
    /// cells and those with an owned master.
    pub slaves: Vec<Slave>,
    /// True if nodes hang anywhere in the mesh.
    pub hanging: bool,
}

/// How near a node is to a rank.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Near {
    Owned,
    Local,
    Halo,
    Away,
}

impl MeshPart {
    /// The share of `rank` among `parts` ranks, given each cell's owner.
    pub fn new(mesh: &Mesh, owner_of_cell: &[u32], rank: u32, parts: usize) -> Self {
        Self::with_numbering(mesh, owner_of_cell, rank, &Numbering::new(mesh, owner_of_cell, parts))
    }

    /// As [`MeshPart::new`], with a numbering at hand.
    pub fn with_numbering(mesh: &Mesh, owner_of_cell: &[u32], rank: u32, numbering: &Numbering) -> Self {
        let owned = numbering.offsets[rank as usize]..numbering.offsets[rank as usize + 1];
        let mut near: Vec<Near> = numbering
            .new_of_old
            .iter()
            .map(|global| if owned.contains(global) { Near::Owned } else { Near::Away })
            .collect();
        let own = |cell: &usize| owner_of_cell[*cell] == rank;
        let mut chosen: Vec<usize> = (0..mesh.cells.len()).filter(own).collect();
        let n_own_cells = chosen.len();
        raise(&mut near, mesh, &chosen, Near::Local);
        let slaves = mesh.slaves();
        for slave in &slaves {
            if near[slave.node as usize] <= Near::Local {
                for &(master, _) in &slave.masters {
                    let master = &mut near[master as usize];
                    *master = Near::Local.min(*master);
                }
            }
        }
        let mut wanted = vec![false; if slaves.is_empty() { 0 } else { mesh.points.len() }];
        for slave in &slaves {
            wanted[slave.node as usize] = slave.masters.iter().any(|(m, _)| near[*m as usize] == Near::Owned);
        }
        let touches = |cell: &usize| {
            let mut nodes = mesh.cells[*cell].nodes().iter();
            nodes.any(|&n| near[n as usize] <= Near::Local || wanted.get(n as usize) == Some(&true))
        };
        let halo: Vec<usize> = (0..mesh.cells.len()).filter(|cell| !own(cell) && touches(cell)).collect();
        raise(&mut near, mesh, &halo, Near::Halo);
        chosen.extend(halo);

        let mut original: Vec<u32> =
            (0..mesh.points.len() as u32).filter(|&n| near[n as usize] != Near::Away).collect();
        original.sort_by_key(|&n| (near[n as usize], numbering.new_of_old[n as usize]));
        let mut local = vec![u32::MAX; mesh.points.len()];
        original.iter().enumerate().for_each(|(i, &n)| local[n as usize] = i as u32);
        let count = |up_to: Near| original.iter().filter(|&&n| near[n as usize] <= up_to).count();

        let mut local_cell = vec![u32::MAX; mesh.cells.len()];
        chosen[..n_own_cells].iter().enumerate().for_each(|(i, &cell)| local_cell[cell] = i as u32);
        let own_facets = |facets: &Vec<Facet>| {
            let moved = facets.iter().map(|f| Facet { cell: local_cell[f.cell as usize], side: f.side });
            moved.filter(|f| f.cell != u32::MAX).collect()
        };
        let renumbered = |cell: &usize| {
            let cell = &mesh.cells[*cell];
            let nodes: Vec<u32> = cell.nodes().iter().map(|&n| local[n as usize]).collect();
            cell.on(&nodes)
        };
        MeshPart {
            dim: mesh.dim,
            points: original.iter().map(|&n| mesh.points[n as usize]).collect(),
            global: original.iter().map(|&n| numbering.new_of_old[n as usize]).collect(),
            n_owned: count(Near::Owned),
            n_local: count(Near::Local),
            cells: chosen.iter().map(renumbered).collect(),
            n_own_cells,
            original_cells: chosen.iter().map(|&cell| cell as u32).collect(),
            surfaces: mesh.surfaces.iter().map(|(name, list)| (name.clone(), own_facets(list))).collect(),
            first_owned: owned.start as usize,
            n_global_nodes: mesh.points.len(),
            n_global_cells: mesh.cells.len(),
            hanging: !slaves.is_empty(),
            slaves: local_slaves(slaves, &local),
            original,
        }
    }

    /// Nodes of a facet, local numbers: the two ends, then the mid-side node; the body lies to the left.
    pub fn facet_nodes(&self, facet: Facet) -> impl Iterator<Item = u32> + '_ {
        self.cells[facet.cell as usize].facet_nodes(facet.side)
    }
}

/// Slaves in a part's numbers, by them, all of whose nodes the part has.
fn local_slaves(slaves: Vec<Slave>, local: &[u32]) -> Vec<Slave> {
    let number = |node: u32| Some(local[node as usize]).filter(|&n| n != u32::MAX);
    let here = |slave: Slave| {
        let masters = slave.masters.into_iter().map(|(m, weight)| Some((number(m)?, weight)));
        Some(Slave { node: number(slave.node)?, masters: masters.collect::<Option<_>>()? })
    };
    let mut here: Vec<Slave> = slaves.into_iter().filter_map(here).collect();
    here.sort_by_key(|slave| slave.node);
    here
}

/// Brings the nodes of the cells at least as near as `to`.
fn raise(near: &mut [Near], mesh: &Mesh, cells: &[usize], to: Near) {
    for &cell in cells {
        for &node in mesh.cells[cell].nodes() {
            let node = &mut near[node as usize];
            *node = to.min(*node);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::ElementKind;
    use crate::mesh::partition;
    use crate::mesh::testing::unit_square;
    use std::collections::BTreeSet;

    fn split(mesh: &Mesh, parts: usize) -> (Vec<MeshPart>, Vec<u32>) {
        let owner = partition(mesh, parts).unwrap();
        ((0..parts as u32).map(|rank| MeshPart::new(mesh, &owner, rank, parts)).collect(), owner)
    }

    #[test]
    fn parts_reassemble_the_mesh() {
        for kind in ElementKind::ALL {
            let mesh = unit_square(kind, 7);
            for n in [1, 2, 3, 4] {
                let (parts, owner) = split(&mesh, n);
                let numbering = Numbering::new(&mesh, &owner, n);
                let (mut seen, mut cells) = (BTreeSet::new(), BTreeSet::new());
                for (rank, part) in parts.iter().enumerate() {
                    for (i, (&old, &new)) in part.original.iter().zip(&part.global).enumerate() {
                        assert_eq!(part.points[i], mesh.points[old as usize]);
                        assert_eq!(numbering.new_of_old[old as usize], new);
                        assert_eq!(numbering.owner(new) == rank as u32, i < part.n_owned);
                    }
                    for i in 0..part.n_owned {
                        assert_eq!(part.global[i] as usize, part.first_owned + i);
                        assert!(seen.insert(part.global[i]), "a node has two owners");
                    }
                    for (i, cell) in part.cells.iter().enumerate() {
                        let old = part.original_cells[i] as usize;
                        assert_eq!(owner[old] == rank as u32, i < part.n_own_cells);
                        assert!(i >= part.n_own_cells || cells.insert(old), "a cell has two owners");
                        let back: Vec<u32> =
                            cell.nodes().iter().map(|&n| part.original[n as usize]).collect();
                        assert_eq!(back, mesh.cells[old].nodes());
                    }
                }
                assert_eq!((seen.len(), cells.len()), (mesh.points.len(), mesh.cells.len()));
                for (name, facets) in &mesh.surfaces {
                    let found: BTreeSet<_> = parts
                        .iter()
                        .flat_map(|p| {
                            p.surfaces[name].iter().map(|f| (p.original_cells[f.cell as usize], f.side))
                        })
                        .collect();
                    assert_eq!(found, facets.iter().map(|f| (f.cell, f.side)).collect());
                }
            }
        }
    }

    #[test]
    fn every_cell_at_a_node_of_an_own_cell_is_there() {
        let mesh = unit_square(ElementKind::Tri6, 9);
        for n in [2, 3, 4] {
            let (parts, _) = split(&mesh, n);
            for part in &parts {
                let here: BTreeSet<u32> = part.original_cells.iter().copied().collect();
                let local: BTreeSet<u32> = part.original[..part.n_local].iter().copied().collect();
                let mut touching = BTreeSet::new();
                for (c, cell) in mesh.cells.iter().enumerate() {
                    if cell.nodes().iter().any(|node| local.contains(node)) {
                        touching.insert(c as u32);
                    }
                }
                assert_eq!(here, touching);
                let own = part.cells[..part.n_own_cells].iter().flat_map(|c| c.nodes().to_vec());
                assert_eq!(own.collect::<BTreeSet<_>>(), (0..part.n_local as u32).collect());
            }
        }
    }

    #[test]
    fn one_rank_keeps_the_order_of_the_mesh() {
        let mesh = unit_square(ElementKind::Quad8, 4);
        let (parts, _) = split(&mesh, 1);
        assert_eq!(parts[0].points, mesh.points);
        assert_eq!(parts[0].cells, mesh.cells);
        assert_eq!(parts[0].surfaces, mesh.surfaces);
    }
}
