//! Connected components of a mesh.
use super::Mesh;

/// The component of each node, numbered from 0 in the order of their first nodes, and how many there are.
///
/// Cells are connected if they share a node. A node of no cell is a component of its own.
pub fn components(mesh: &Mesh) -> (Vec<u32>, usize) {
    let mut parent: Vec<u32> = (0..mesh.points.len() as u32).collect();
    for cell in &mesh.cells {
        let first = root(&mut parent, cell.nodes()[0]);
        for &node in &cell.nodes()[1..] {
            let other = root(&mut parent, node);
            let first = root(&mut parent, first);
            // The smallest node is the root, so that numbers come in node order.
            let (low, high) = (first.min(other), first.max(other));
            parent[high as usize] = low;
        }
    }
    let mut count = 0;
    let mut number = vec![0; parent.len()];
    for node in 0..parent.len() as u32 {
        let r = root(&mut parent, node);
        if r == node {
            number[node as usize] = count;
            count += 1;
        } else {
            number[node as usize] = number[r as usize];
        }
    }
    (number, count as usize)
}

fn root(parent: &mut [u32], mut node: u32) -> u32 {
    while parent[node as usize] != node {
        parent[node as usize] = parent[parent[node as usize] as usize];
        node = parent[node as usize];
    }
    node
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::ElementKind;
    use crate::mesh::testing::unit_square;

    #[test]
    fn one_square_is_one_component_and_two_are_two() {
        let mut mesh = unit_square(ElementKind::Quad8, 3);
        assert_eq!(components(&mesh).1, 1);
        let (n, other) = (mesh.points.len(), mesh.clone());
        mesh.append(&other);
        let (number, count) = components(&mesh);
        assert_eq!(count, 2);
        assert!(number[..n].iter().all(|&c| c == 0) && number[n..].iter().all(|&c| c == 1));
    }
}
