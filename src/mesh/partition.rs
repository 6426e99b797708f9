//! Which rank owns which cell.
use super::Mesh;
use crate::error::{Error, Result};
use metis::option::{Contig, Seed};
use metis::{Graph, Idx};
use std::sync::Mutex;

/// METIS draws from C's `rand`, one state per process: two threads at once would not get the seed's sequence.
static METIS: Mutex<()> = Mutex::new(());

/// Owner of each cell among `parts` ranks, by METIS on the graph of cells that share a side.
///
/// The same mesh always gets the same owners; parts are contiguous if the mesh is connected; none is empty.
pub fn partition(mesh: &Mesh, parts: usize) -> Result<Vec<u32>> {
    let n = mesh.cells.len();
    if parts == 0 {
        return Err(Error::internal("partition: 0 parts"));
    }
    if n < parts {
        return Err(Error::input(format!(
            "fewer cells than ranks: {n} cells cannot be shared by {parts} ranks"
        )));
    }
    if parts == 1 {
        return Ok(vec![0; n]);
    }
    let index =
        |value: usize| Idx::try_from(value).map_err(|_| Error::input("the mesh is too large for METIS"));
    let failed = |e: &dyn std::fmt::Display| Error::internal(format!("METIS: {e}"));
    let mut start = vec![0];
    let mut corners: Vec<Idx> = Vec::new();
    // Two cells with two nodes in common are neighbours: a coarse cell has the finer corner in its side, too.
    let mut hanging = std::collections::HashMap::<u32, Vec<u32>>::new();
    mesh.hanging.iter().for_each(|s| hanging.entry(s.coarse.cell).or_default().push(s.middle));
    for (c, cell) in mesh.cells.iter().enumerate() {
        let own = &cell.nodes()[..cell.kind.n_corners()];
        for &node in own.iter().chain(hanging.get(&(c as u32)).into_iter().flatten()) {
            corners.push(index(node as usize)?);
        }
        start.push(index(corners.len())?);
    }
    let dual = metis::mesh_to_dual(&start, &corners, 2).map_err(|e| failed(&e))?;
    let mut owner = vec![0; n];
    let _alone = METIS.lock();
    Graph::new(1, index(parts)?, dual.xadj(), dual.adjncy())
        .map_err(|e| failed(&e))?
        .set_option(Seed(1))
        .set_option(Contig(connected(dual.xadj(), dual.adjncy())))
        .part_kway(&mut owner)
        .map_err(|e| failed(&e))?;

    let mut owner: Vec<u32> = owner.into_iter().map(|part| part as u32).collect();
    let mut used = vec![false; parts];
    owner.iter().for_each(|&part| used[part as usize] = true);
    if used.contains(&false) {
        // METIS may leave a part empty when there are only a few cells for each: then runs of consecutive
        // cells.
        owner = (0..n).map(|cell| (cell * parts / n) as u32).collect();
    }
    Ok(owner)
}

/// Makes rank 0 the owner of `nodes`: it gets every cell with a side among them, and for a node that lies on no such
/// cell the first cell that has it. (A node belongs to the lowest rank among its cells' owners.)
pub fn give_to_first(mesh: &Mesh, owner: &mut [u32], nodes: &[u32]) {
    let mut wanted = vec![false; mesh.points.len()];
    nodes.iter().for_each(|&node| wanted[node as usize] = true);
    let mut own = vec![false; mesh.points.len()];
    let mut give = |cell: usize, owner: &mut [u32]| {
        owner[cell] = 0;
        mesh.cells[cell].nodes().iter().for_each(|&node| own[node as usize] = true);
    };
    for (c, cell) in mesh.cells.iter().enumerate() {
        if owner[c] == 0 || cell.nodes().iter().filter(|&&node| wanted[node as usize]).count() > 1 {
            give(c, owner);
        }
    }
    for (c, cell) in mesh.cells.iter().enumerate() {
        if cell.nodes().iter().any(|&node| wanted[node as usize] && !own[node as usize]) {
            owner[c] = 0;
            cell.nodes().iter().for_each(|&node| own[node as usize] = true);
        }
    }
}

/// True if every vertex of a graph in compressed rows can be reached from the first.
fn connected(start: &[Idx], neighbours: &[Idx]) -> bool {
    let n = start.len() - 1;
    let mut seen = vec![false; n];
    let mut stack = vec![0];
    let mut count = 0;
    seen[0] = true;
    while let Some(v) = stack.pop() {
        count += 1;
        for &w in &neighbours[start[v] as usize..start[v + 1] as usize] {
            if !std::mem::replace(&mut seen[w as usize], true) {
                stack.push(w as usize);
            }
        }
    }
    count == n
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::ElementKind;
    use crate::mesh::testing::unit_square;

    /// Cells of one owner, connected through sides.
    fn contiguous(mesh: &Mesh, owner: &[u32], part: u32) -> bool {
        let mut sub = Mesh { dim: 2, points: mesh.points.clone(), ..Mesh::default() };
        sub.cells =
            mesh.cells.iter().zip(owner).filter(|(_, o)| **o == part).map(|(c, _)| c.clone()).collect();
        let mut sides = std::collections::HashMap::new();
        let mut reached = vec![false; sub.cells.len()];
        for (ends, facet) in sub.sides() {
            sides.entry(ends).or_insert_with(Vec::new).push(facet.cell as usize);
        }
        reached[0] = true;
        for _ in 0..sub.cells.len() {
            for cells in sides.values() {
                if cells.iter().any(|&c| reached[c]) {
                    cells.iter().for_each(|&c| reached[c] = true);
                }
            }
        }
        !reached.contains(&false)
    }

    #[test]
    fn parts_are_balanced_contiguous_and_repeatable() {
        for kind in ElementKind::ALL {
            let mesh = unit_square(kind, 20);
            for parts in [1, 2, 3, 5, 8] {
                let owner = partition(&mesh, parts).unwrap();
                assert_eq!(owner, partition(&mesh, parts).unwrap());
                for part in 0..parts as u32 {
                    let count = owner.iter().filter(|&&o| o == part).count() as f64;
                    let mean = mesh.cells.len() as f64 / parts as f64;
                    assert!((count / mean - 1.0).abs() < 0.15, "{kind:?}: {count} cells of {mean}");
                    assert!(contiguous(&mesh, &owner, part), "{kind:?}, {parts} parts: {part} is in pieces");
                }
            }
        }
    }

    #[test]
    fn the_first_rank_gets_the_nodes_it_is_given() {
        for kind in ElementKind::ALL {
            let mesh = unit_square(kind, 12);
            let mut nodes: Vec<u32> =
                mesh.surfaces["top"].iter().flat_map(|&f| mesh.facet_nodes(f)).collect();
            nodes.push(40);
            for parts in [1, 2, 4] {
                let mut owner = partition(&mesh, parts).unwrap();
                give_to_first(&mesh, &mut owner, &nodes);
                let numbering = crate::mesh::Numbering::new(&mesh, &owner, parts);
                for &node in &nodes {
                    assert_eq!(numbering.owner(numbering.new_of_old[node as usize]), 0, "{kind:?}");
                }
                let moved = owner.iter().filter(|&&o| o == 0).count() as f64;
                assert!(parts == 1 || moved < 0.75 * owner.len() as f64, "{kind:?}: {moved}");
            }
        }
    }

    #[test]
    fn every_rank_gets_a_cell_on_tiny_and_on_disconnected_meshes() {
        let tiny = unit_square(ElementKind::Quad4, 2);
        let mut two = unit_square(ElementKind::Tri3, 3);
        two.append(&two.clone());
        for mesh in [tiny, two] {
            for parts in 1..=mesh.cells.len() {
                let owner = partition(&mesh, parts).unwrap();
                assert!((0..parts as u32).all(|p| owner.contains(&p)), "{parts} parts: {owner:?}");
            }
            let error = partition(&mesh, mesh.cells.len() + 1).unwrap_err();
            assert!(error.to_string().contains("fewer cells than ranks"), "{error}");
        }
    }
}
