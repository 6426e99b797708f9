//! A motion of several bodies in words: which of them move together, and how.
use super::RigidMode;
use super::rigid::describe;
use crate::vector::{larger, largest, worst};
use nalgebra::Vector3;

/// Parts of a motion below this share of its largest displacement are none: it is told, not computed with.
const TOLD: f64 = 1e-3;

/// The rigid motion of a body, or of a piece of one: u = t + theta e_z x (x - c).
#[derive(Debug, Clone, Copy, PartialEq)]
struct Moved {
    body: usize,
    piece: u32,
    translation: [f64; 2],
    rotation: f64,
    center: [f64; 2],
    /// Largest distance of a node from c, m.
    length: f64,
}

impl Moved {
    /// Largest displacement, m.
    fn size(&self) -> f64 {
        self.translation[0].hypot(self.translation[1]) + self.rotation.abs() * self.length
    }

    /// Displacement that the same rigid motion has at a point.
    fn at(&self, x: [f64; 2]) -> [f64; 2] {
        let [t, c] = [self.translation, self.center];
        [t[0] - self.rotation * (x[1] - c[1]), t[1] + self.rotation * (x[0] - c[0])]
    }

    /// In words, about a centre and over a length.
    fn name(&self, center: [f64; 2], length: f64) -> String {
        let [x, y] = self.at(center);
        let turn = self.rotation * length;
        let told = |v: f64| if v.abs() < TOLD * largest([&x, &y, &turn]) { 0.0 } else { v };
        let mut motion = Vector3::new(told(x), told(y), told(turn)).normalize();
        if motion[motion.iamax()] < 0.0 {
            motion = -motion;
        }
        describe(&motion, center, larger(length, f64::MIN_POSITIVE))
    }
}

/// A motion of modes with amplitudes: the bodies that move, in ascending order, and how.
///
/// `modes`: body, mode, amplitude, m.
pub fn name_motion(names: &[&str], modes: &[(usize, &RigidMode, f64)]) -> (Vec<usize>, String) {
    let mut moved: Vec<Moved> = Vec::new();
    for &(body, mode, amplitude) in modes {
        let center = [mode.center[0], mode.center[1]];
        // (t, theta L) is a unit vector.
        let rest = 1.0 - mode.translation.iter().map(|t| t * t).sum::<f64>();
        let length = if mode.rotation == 0.0 { 0.0 } else { larger(rest, 0.0).sqrt() / mode.rotation.abs() };
        let (t, w) = (mode.translation.map(|t| amplitude * t), amplitude * mode.rotation);
        match moved.iter_mut().find(|m| (m.body, m.piece) == (body, mode.piece)) {
            Some(m) => {
                m.translation = [m.translation[0] + t[0], m.translation[1] + t[1]];
                m.rotation += w;
                m.length = larger(m.length, length);
            }
            None => moved.push(Moved {
                body,
                piece: mode.piece,
                translation: [t[0], t[1]],
                rotation: w,
                center,
                length,
            }),
        }
    }
    let most = worst(moved.iter().map(Moved::size));
    moved.retain(|m| m.size() > TOLD * most);
    moved.sort_by_key(|m| (m.body, m.piece));
    let mut bodies: Vec<usize> = moved.iter().map(|m| m.body).collect();
    bodies.dedup();
    let quoted = |b: usize| format!("'{}'", names[b]);
    let text = match &moved[..] {
        [] => String::new(),
        [one] => one.name(one.center, one.length),
        [first, ..] if moved.iter().all(|m| same(first, m, most)) => {
            let n = moved.len() as f64;
            let center = [0, 1].map(|d| moved.iter().map(|m| m.center[d]).sum::<f64>() / n);
            let reach = |m: &Moved| (m.center[0] - center[0]).hypot(m.center[1] - center[1]) + m.length;
            first.name(center, worst(moved.iter().map(reach)))
        }
        _ => {
            let each = moved.iter().map(|m| format!("{} {}", quoted(m.body), m.name(m.center, m.length)));
            each.collect::<Vec<_>>().join(", ")
        }
    };
    (bodies, text)
}

/// True if two bodies move as if they were one.
fn same(a: &Moved, b: &Moved, largest: f64) -> bool {
    let [there, here] = [a.at(b.center), b.translation];
    let turned = (a.rotation - b.rotation).abs() * larger(b.length, a.length);
    (there[0] - here[0]).hypot(there[1] - here[1]) + turned <= TOLD * largest
}

/// `body 'a'`, `bodies 'a' and 'b'`, `bodies 'a', 'b' and 'c'`.
pub fn name_bodies(names: &[&str]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("'{name}'")).collect();
    match &quoted[..] {
        [one] => format!("body {one}"),
        [most @ .., last] => format!("bodies {} and {last}", most.join(", ")),
        [] => "no body".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The three motions of a body with this centre and length.
    fn modes(center: [f64; 2], length: f64) -> [RigidMode; 3] {
        let center = [center[0], center[1], 0.0];
        let mode = |translation, rotation| RigidMode {
            name: String::new(),
            piece: 0,
            translation,
            rotation,
            center,
        };
        [mode([1.0, 0.0, 0.0], 0.0), mode([0.0, 1.0, 0.0], 0.0), mode([0.0; 3], 1.0 / length)]
    }

    #[test]
    fn bodies_that_move_as_one_are_named_together() {
        let names = ["lower", "upper", "side"];
        let (a, b) = (modes([0.0, 0.0], 1.0), modes([0.0, 2.0], 0.5));
        let together = [(0, &a[1], -0.3), (1, &b[1], -0.3), (1, &b[0], 1e-9), (2, &a[0], 0.0)];
        assert_eq!(name_motion(&names, &together), (vec![0, 1], "translation y".into()));
        // Both about the origin by the same angle: the second one is carried along by -2 in x.
        let turned = [(0, &a[2], 0.1), (1, &b[2], 0.05), (1, &b[0], -0.2)];
        assert_eq!(name_motion(&names, &turned), (vec![0, 1], "rotation about (0, 0)".into()));
        let apart = [(0, &a[0], 0.3), (1, &b[1], 0.3)];
        let text = "'lower' translation x, 'upper' translation y";
        assert_eq!(name_motion(&names, &apart), (vec![0, 1], text.into()));
        assert_eq!(name_motion(&names, &[(2, &a[0], -1.0)]), (vec![2], "translation x".into()));
        assert_eq!(name_bodies(&names), "bodies 'lower', 'upper' and 'side'");
        assert_eq!(name_bodies(&names[..1]), "body 'lower'");
    }
}
