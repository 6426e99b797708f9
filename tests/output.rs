//! The result file: written by 1, 2 and 3 ranks, read back and compared with what each rank held.
use kontakt::case::{Analysis, Units};
use kontakt::contact::Law;
use kontakt::element::ElementKind;
use kontakt::mesh::Cell;
use kontakt::output::*;
use kontakt::record::*;
use mpi::topology::SimpleCommunicator;
use mpi::traits::*;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// mpirun with the settings that make it usable in containers, as root and on few cores.
fn mpirun(ranks: usize) -> Command {
    let mut command = Command::new("timeout"); // a deadlock must fail, not hang
    command.args(["--kill-after=5", "120", "mpirun", "-n", &ranks.to_string()]);
    for (key, value) in [
        ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
        ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
        ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
        ("OMPI_MCA_mpi_yield_when_idle", "1"),
        ("OMPI_MCA_hwloc_base_binding_policy", "none"),
        ("OMPI_MCA_btl_vader_single_copy_mechanism", "none"),
    ] {
        command.env(key, value);
    }
    command
}

/// Re-runs the test `name` of this executable on some ranks.
fn child(name: &str, ranks: usize, directory: &Path) -> Command {
    let mut command = mpirun(ranks);
    command.arg(std::env::current_exe().unwrap());
    command.args(["--exact", name, "--nocapture", "--test-threads=1"]).env("KONTAKT_TEST_DIR", directory);
    command
}

/// Runs `body` on every rank, in a directory that lives until all are done; then `after` in this process.
fn on_ranks(name: &str, ranks: &[usize], body: fn(&SimpleCommunicator, &Path), after: fn(&Path, usize)) {
    if let Some(directory) = std::env::var_os("KONTAKT_TEST_DIR") {
        let universe = mpi::initialize().unwrap();
        // A panic on one rank would leave the others waiting: end all of them.
        let run = || body(&universe.world(), Path::new(&directory));
        if std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)).is_err() {
            universe.world().abort(1);
        }
        return;
    }
    for &ranks in ranks {
        let directory = tempfile::tempdir().unwrap();
        let out = child(name, ranks, directory.path()).output().unwrap();
        let [stdout, stderr] = [&out.stdout, &out.stderr].map(|text| String::from_utf8_lossy(text));
        assert!(out.status.success(), "{ranks} ranks:\n{stdout}\n{stderr}");
        // The libraries keep quiet: what is to be said comes back as an error.
        assert!(!stderr.contains("HDF5"), "{stderr}");
        after(directory.path(), ranks);
    }
}

/// Two cells of different kinds on every rank but rank 1, which has none.
fn piece(rank: i32) -> Piece {
    let r = f64::from(rank);
    let field = |name: &str, unit, components: usize, n: usize| Field {
        name: name.into(),
        unit,
        components,
        values: (0..components * n).map(|i| 1000.0 * r + i as f64 + 0.25).collect(),
    };
    let n = if rank == 1 { 0 } else { 1 };
    let points =
        [[r, 0.0, 0.0], [r + 1.0, 0.0, 0.0], [r + 1.0, 1.0, 0.0], [r, 1.0, 0.0], [r + 0.5, 2.0, 0.0]];
    let cells = [Cell::new(ElementKind::Quad4, &[0, 1, 2, 3]), Cell::new(ElementKind::Tri3, &[3, 2, 4])];
    Piece {
        points: points[..5 * n].to_vec(),
        cells: cells[..2 * n].to_vec(),
        cell_bodies: vec![rank; 2 * n],
        // In alphabetical order, as they are read back.
        point_fields: vec![
            field("displacement", "m", 3, 5 * n),
            field("stress", "Pa", 6, 5 * n),
            field("temperature", "K", 1, 5 * n),
        ],
        cell_fields: vec![field("stress", "Pa", 6, 2 * n), field("von_mises", "Pa", 1, 2 * n)],
    }
}

fn side(k: f64, n: usize) -> SideTable {
    let numbers = |factor: f64| (0..n).map(|i| k + factor * i as f64).collect::<Vec<_>>();
    let vectors = |factor: f64| (0..n).map(|i| [k, factor, i as f64]).collect::<Vec<_>>();
    SideTable {
        s: numbers(0.5),
        x: vectors(0.1),
        normal: vectors(0.2),
        gap: numbers(-0.25),
        pressure: numbers(7.0),
        force: vectors(0.3),
        status: (0..n as i32).map(|i| i % 3).collect(),
        multipliers: k == 1.0,
        closed: (k == 2.0).then_some(7.5),
        tangential: None,
        bonded: false,
    }
}

/// A side of a pair with a tangential law.
fn rubbing() -> SideTable {
    let tangential = Tangential { traction: vec![2.5, -7.5], slip: vec![0.0, 1e-6] };
    SideTable { tangential: Some(tangential), status: vec![2, 3], ..side(3.0, 2) }
}

/// The sides of the pairs lie on the last and on the first rank; side b of the second on none.
fn pairs(rank: i32, size: i32) -> Vec<PairTables> {
    let surfaces = ["upper.bottom".to_string(), "lower.top".to_string()];
    let on = |owner, table: SideTable| (rank == owner).then_some(table);
    let [first, last] = [0, size - 1];
    vec![
        PairTables {
            law: Law::Frictionless,
            varies: false,
            name: "p/1 ä".into(),
            surfaces: surfaces.clone(),
            sides: [on(last, side(1.0, 4)), on(first, side(2.0, 3))],
        },
        PairTables {
            law: Law::Tresca { shear: 7.5 },
            varies: false,
            name: "q".into(),
            surfaces,
            sides: [on(last, rubbing()), None],
        },
    ]
}

fn history() -> Vec<HistoryRow> {
    let pair = |i: u64, p: u64| PairRow {
        gap: 1e-9 * (i + 2 * p) as f64,
        penetration: 1e-8 / (i + p + 1) as f64,
        active: 3 + i + p,
        open: 9 - i,
        flips: p,
        force_imbalance: 1e-13,
        contraction: Some(0.2 + 0.1 * p as f64),
    };
    let row = |i: u64| HistoryRow {
        step: 1,
        increment: 1,
        alternation: i + 1,
        update: i / 2 + 1,
        displacement_jump: 0.1f64.powi(i as i32),
        force_imbalance: 1e-12,
        penetration: 1e-7 * 0.5f64.powi(i as i32),
        gap: 1e-8 * 0.5f64.powi(i as i32),
        active: 7 + i,
        open: 20 - i,
        flips: i % 2,
        contraction: Some(0.1),
        seconds: i as f64 * 0.5,
        pairs: vec![pair(i, 0), pair(i, 1)],
    };
    (0..3).map(row).collect()
}

fn run_info(units: Units) -> RunInfo {
    RunInfo {
        case: "heated-gap".into(),
        title: "Gap of 10 µm".into(),
        variant: Some("C".into()),
        text: "title = \"x\"\n".repeat(10_000), // more than an attribute could hold
        units,
        analysis: Analysis::PlaneStrain { thickness: 0.02 },
        bodies: vec!["upper".into(), "ló".into(), "c".into()],
        reason: Reason::Converged,
        alternations: 3,
        tolerance: 1e-8,
        steps: None,
        rigid: Vec::new(),
    }
}

/// Writes the standard file.
fn write_standard(world: &SimpleCommunicator, path: &Path) -> kontakt::Result<()> {
    let (rank, size) = (world.rank(), world.size());
    let (piece, pairs, run) = (piece(rank), pairs(rank, size), run_info(Units::Si));
    let history = if rank == 0 { history() } else { vec![] };
    write(world, path, &ResultFile { piece: &piece, pairs: &pairs, history: &history, run: &run })
}

fn check_standard(path: &Path, ranks: i32) {
    let read = Results::read(path).unwrap();
    let expected: Vec<Piece> = (0..ranks).map(piece).collect();
    assert_eq!(read.piece.points, expected.iter().flat_map(|p| p.points.clone()).collect::<Vec<_>>());
    assert_eq!(
        read.piece.cell_bodies,
        expected.iter().flat_map(|p| p.cell_bodies.clone()).collect::<Vec<_>>()
    );
    let first: Vec<usize> =
        (0..ranks as usize).map(|r| expected[..r].iter().map(|p| p.points.len()).sum()).collect();
    assert_eq!(read.partitions.iter().map(|p| p[0]).collect::<Vec<_>>(), first);
    let cells = expected.iter().zip(&first).flat_map(|(p, first)| {
        p.cells.iter().map(move |c| {
            let nodes: Vec<u32> = c.nodes().iter().map(|i| i + *first as u32).collect();
            Cell::new(c.kind, &nodes)
        })
    });
    assert_eq!(read.piece.cells, cells.collect::<Vec<_>>());
    let fields: [fn(&Piece) -> &Vec<Field>; 2] = [|p| &p.point_fields, |p| &p.cell_fields];
    for of in fields {
        assert_eq!(of(&read.piece).len(), of(&expected[0]).len());
        for (k, field) in of(&read.piece).iter().enumerate() {
            let one = &of(&expected[0])[k];
            assert_eq!((&field.name, field.unit, field.components), (&one.name, one.unit, one.components));
            assert_eq!(
                field.values,
                expected.iter().flat_map(|p| of(p)[k].values.clone()).collect::<Vec<_>>()
            );
        }
    }
    let empty = SideTable { tangential: Some(Tangential::default()), ..SideTable::default() };
    for (name, k, table) in
        [("p/1 ä", 0, side(1.0, 4)), ("p/1 ä", 1, side(2.0, 3)), ("q", 0, rubbing()), ("q", 1, empty)]
    {
        let pair = read.pairs.iter().find(|p| p.name == name).unwrap();
        assert_eq!(pair.surfaces, ["upper.bottom", "lower.top"]);
        let law = if name == "q" { Law::Tresca { shear: 7.5 } } else { Law::Frictionless };
        assert_eq!(pair.law, law);
        let read = pair.sides[k].as_ref().unwrap();
        assert_eq!(format!("{read:?}"), format!("{table:?}"));
    }
    assert_eq!(read.history, history());
    assert!(read.before.is_empty() && read.complete);
    assert_eq!(format!("{:?}", read.run), format!("{:?}", run_info(Units::Si)));
}

#[test]
fn every_dataset_comes_back() {
    on_ranks(
        "every_dataset_comes_back",
        &[1, 2, 3],
        |world, directory| {
            let directory = directory.join("new/results");
            prepare(world, &directory).unwrap();
            write_standard(world, &directory.join(RESULT)).unwrap();
        },
        |directory, ranks| {
            let directory = directory.join("new/results");
            check_standard(&directory.join(RESULT), ranks as i32);
            assert_eq!(names(&directory), [RESULT]);
            keep(&directory.join(RESULT), &format!("standard-{ranks}.vtkhdf"));
        },
    );
}

/// Layout of a file without load steps: every group and dataset, with the shape of those that do not depend on the
/// ranks.
#[test]
fn without_steps_nothing_of_them_is_stored() {
    on_ranks(
        "without_steps_nothing_of_them_is_stored",
        &[1],
        |world, directory| write_standard(world, &directory.join(RESULT)).unwrap(),
        |directory, _| {
            let file = hdf5::File::open(directory.join(RESULT)).unwrap();
            let names = |group: &str| file.group(group).unwrap().member_names().unwrap().join(" ");
            assert_eq!(names("/"), "VTKHDF contact history run");
            assert_eq!(
                names("VTKHDF"),
                "CellData Connectivity FieldData NumberOfCells NumberOfConnectivityIds NumberOfPoints Offsets \
                 PointData Points Types"
            );
            let version = file.group("VTKHDF").unwrap().attr("Version").unwrap().read_raw::<i64>().unwrap();
            assert_eq!(version, [1, 0]);
            assert_eq!(names("contact/p_1 ä/a"), "force gap normal pressure s status x");
            assert_eq!(names("contact/q/a"), "force gap normal pressure s slip status traction x");
            let facts = |pair: &str| {
                let mut names = file.group(pair).unwrap().attr_names().unwrap();
                names.sort();
                names.join(" ")
            };
            assert_eq!([facts("contact/p_1 ä"), facts("contact/q")], ["name", "law name shear"]);
            assert_eq!(
                names("history"),
                "active alternation contraction displacement_jump flips force_imbalance gap open pairs penetration \
                 seconds update"
            );
            assert_eq!(
                names("history/pairs/q"),
                "active contraction flips force_imbalance gap open penetration"
            );
        },
    );
}

/// The results of step `k` (0, 1, ...) of three: those of the standard file, moved.
fn state(rank: i32, size: i32, k: usize) -> State {
    let Piece { mut point_fields, mut cell_fields, .. } = piece(rank);
    let fields = point_fields.iter_mut().chain(&mut cell_fields);
    fields.flat_map(|field| &mut field.values).for_each(|value| *value += 1e6 * k as f64);
    let mut pairs = pairs(rank, size);
    for table in pairs.iter_mut().flat_map(|pair| pair.sides.iter_mut().flatten()) {
        table.pressure.iter_mut().for_each(|p| *p += 100.0 * k as f64);
        table.normal.iter_mut().for_each(|n| n[2] += k as f64);
        table.status.iter_mut().for_each(|s| *s = (*s + k as i32) % 3);
    }
    State { point_fields, cell_fields, pairs }
}

fn stepped_run() -> RunInfo {
    let step = |k: u64, name: Option<&str>, reason| LoadStep {
        name: name.map(Into::into),
        loads: 0.5 * k as f64,
        supports: 1.0,
        temperature: 1.0 - 0.25 * k as f64,
        at: Some(0.5 + k as f64),
        paths: [("shear".into(), 0.1 * k as f64), ("preload".into(), 1.0)].into(),
        increments: 1 + k,
        reason,
        alternations: 3 + k,
        updates: k,
    };
    let steps = vec![
        step(0, Some("press ä"), Reason::Converged),
        step(1, None, Reason::Stalled),
        step(2, Some("cool"), Reason::Converged),
    ];
    let rigid = vec![Outline {
        body: "anvil".into(),
        points: vec![[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
        motion: [0.0, 1e-3, 0.0],
    }];
    RunInfo { text: "a".into(), alternations: 12, steps: Some(steps), rigid, ..run_info(Units::Si) }
}

fn stepped_history() -> Vec<HistoryRow> {
    let of_step = |step| {
        history().into_iter().map(move |row| HistoryRow { step, increment: 1 + row.alternation / 2, ..row })
    };
    (1..=3).flat_map(of_step).collect()
}

/// The run after its first `n` steps, and the history of the last of them.
fn run_after(n: usize) -> (RunInfo, Vec<HistoryRow>) {
    let mut run = stepped_run();
    run.steps.as_mut().unwrap().truncate(n);
    (run, stepped_history().into_iter().filter(|row| row.step == n as u64).collect())
}

/// Adds step `k` (0, 1, ...) of three.
fn append(world: &SimpleCommunicator, file: &mut Growing, k: usize) -> kontakt::Result<()> {
    let State { point_fields, cell_fields, pairs } = state(world.rank(), world.size(), k);
    let piece = Piece { point_fields, cell_fields, ..piece(world.rank()) };
    let (run, history) = run_after(k + 1);
    let history = if world.rank() == 0 { history } else { vec![] };
    file.append(world, &ResultFile { piece: &piece, pairs: &pairs, history: &history, run: &run })
}

/// Three steps, of which `expected` are.
fn grow(world: &SimpleCommunicator, path: &Path, at_once: bool, expected: usize) {
    let names = ["press ä", "", "cool", "", ""].map(|name| Some(name).filter(|name| !name.is_empty()));
    let mut file = Growing::new(path, at_once, names.into_iter().take(expected));
    for k in 0..3 {
        append(world, &mut file, k).unwrap();
        if k == 1 {
            // A step without its results, or whose fields are others, is refused, on all ranks.
            let e = append(world, &mut file, 1).unwrap_err();
            assert!(e.to_string().contains("every step"), "{e}");
            let (piece, (run, _)) = (piece(world.rank()), run_after(3));
            let other = ResultFile { piece: &piece, pairs: &[], history: &[], run: &run };
            let e = file.append(world, &other).unwrap_err();
            assert!(e.to_string().contains("differ in fields"), "{e}");
        }
        assert_eq!(file.steps(), k + 1);
        // What there is can be read at any time.
        if world.rank() == 0 && at_once {
            let read = check_steps(path, world.size(), k + 1);
            assert!(!read.complete && !hdf5_converged(path));
        } else if world.rank() == 0 {
            assert!(!path.exists());
        }
        world.barrier();
    }
    file.finish(world, &stepped_run()).unwrap();
}

fn hdf5_converged(path: &Path) -> bool {
    let run = hdf5::File::open(path).unwrap().group("run").unwrap();
    run.attr("converged").unwrap().read_scalar::<u8>().unwrap() != 0
}

#[test]
fn load_steps_come_back() {
    on_ranks(
        "load_steps_come_back",
        &[1, 2, 3],
        |world, directory| grow(world, &directory.join(RESULT), true, 3),
        |directory, ranks| {
            let path = directory.join(RESULT);
            let read = check_steps(&path, ranks as i32, 3);
            assert_eq!(format!("{:?}", read.run), format!("{:?}", stepped_run()));
            assert!(!read.run.converged() && read.complete, "one step did not converge");
            // To draw the pictures the fields of the last step are enough.
            let last = Results::read_last(&path).unwrap();
            assert!(
                last.before.iter().all(|state| state.point_fields.is_empty() && state.cell_fields.is_empty())
            );
            assert_eq!(
                format!("{:?}", (&last.piece, &last.pairs)),
                format!("{:?}", (&read.piece, &read.pairs))
            );
            assert_eq!(names(directory), [RESULT]);
            keep(&path, &format!("steps-{ranks}.vtkhdf"));
        },
    );
}

/// Steps that were halved are more than those of the case, steps that failed fewer.
#[test]
fn there_may_be_more_or_fewer_steps_than_expected() {
    on_ranks(
        "there_may_be_more_or_fewer_steps_than_expected",
        &[1, 2],
        |world, directory| {
            for (expected, at_once) in [(1, true), (2, false), (5, true), (5, false)] {
                let directory = directory.join(format!("{expected}-{at_once}"));
                prepare(world, &directory).unwrap();
                grow(world, &directory.join(RESULT), at_once, expected);
            }
        },
        |directory, ranks| {
            for name in ["1-true", "2-false", "5-true", "5-false"] {
                let directory = directory.join(name);
                check_steps(&directory.join(RESULT), ranks as i32, 3);
                let file = hdf5::File::open(directory.join(RESULT)).unwrap();
                let steps = file.group("contact/p_1 ä/a/steps").unwrap().member_names().unwrap();
                assert_eq!(steps, ["1", "2", "3"], "{name}");
                assert_eq!(names(&directory), [RESULT]);
            }
        },
    );
}

fn check_steps(path: &Path, ranks: i32, n: usize) -> Results {
    let read = Results::read(path).unwrap();
    let (run, history) = (run_after(n).0, stepped_history());
    assert_eq!(format!("{:?}", read.run.steps), format!("{:?}", run.steps));
    assert_eq!(read.history, history.into_iter().filter(|row| row.step <= n as u64).collect::<Vec<_>>());
    assert_eq!(read.before.len(), n - 1);
    for k in 0..n {
        let expected: Vec<State> = (0..ranks).map(|rank| state(rank, ranks, k)).collect();
        let (points, cells, pairs) = match read.before.get(k) {
            Some(state) => (&state.point_fields, &state.cell_fields, &state.pairs),
            None => (&read.piece.point_fields, &read.piece.cell_fields, &read.pairs),
        };
        let join = |fields: fn(&State) -> &Vec<Field>, i: usize| -> Vec<f64> {
            expected.iter().flat_map(|state| fields(state)[i].values.clone()).collect()
        };
        for (i, field) in points.iter().enumerate() {
            assert_eq!(field.values, join(|state| &state.point_fields, i), "step {k} {}", field.name);
        }
        for (i, field) in cells.iter().enumerate() {
            assert_eq!(field.values, join(|state| &state.cell_fields, i), "step {k} {}", field.name);
        }
        let pair = pairs.iter().find(|pair| pair.name == "p/1 ä").unwrap();
        for side in 0..2 {
            let held = expected.iter().find_map(|state| state.pairs[0].sides[side].as_ref());
            assert_eq!(pair.sides[side].as_ref(), held, "step {k}");
        }
    }
    // What VTK's reader goes by.
    let file = hdf5::File::open(path).unwrap();
    let steps = file.group("VTKHDF/Steps").unwrap();
    let column = |name: &str| steps.dataset(name).unwrap().read_raw::<i64>().unwrap();
    let n_points = read.piece.points.len() as i64;
    assert_eq!(steps.attr("NSteps").unwrap().read_scalar::<i64>().unwrap(), n as i64);
    assert_eq!(column("NumberOfParts"), vec![i64::from(ranks); n]);
    assert_eq!(column("PartOffsets"), vec![0; n]);
    assert_eq!(steps.dataset("CellOffsets").unwrap().shape(), [n, 1]);
    assert_eq!(column("PointDataOffsets/stress"), (0..n as i64).map(|k| k * n_points).collect::<Vec<_>>());
    assert_eq!(column("CellDataOffsets/body"), vec![0; n]);
    assert_eq!(steps.dataset("Values").unwrap().read_raw::<f64>().unwrap().len(), n);
    // The table of the pair itself is that of the last step.
    let pair = file.group("contact/p_1 ä").unwrap();
    let pressure = |name: String| pair.dataset(&name).unwrap().read_raw::<f64>().unwrap();
    assert_eq!(pressure("a/pressure".into()), pressure(format!("a/steps/{n}/pressure")));
    read
}

/// Copies a file to `KONTAKT_KEEP`, if set, to look at it with other tools.
fn keep(file: &Path, name: &str) {
    if let Some(directory) = std::env::var_os("KONTAKT_KEEP") {
        std::fs::copy(file, PathBuf::from(directory).join(name)).unwrap();
    }
}

/// Names in a directory, hidden ones included.
fn names(directory: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(directory).unwrap();
    let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn consistent_units_are_not_labelled() {
    on_ranks(
        "consistent_units_are_not_labelled",
        &[1],
        |world, directory| {
            let (piece, run) = (piece(0), run_info(Units::Consistent));
            let file = ResultFile { piece: &piece, pairs: &[], history: &[], run: &run };
            write(world, &directory.join(RESULT), &file).unwrap();
        },
        |directory, _| {
            let read = Results::read(&directory.join(RESULT)).unwrap();
            assert!(read.piece.point_fields.iter().all(|field| field.unit.is_empty()));
            assert_eq!(read.run.units, Units::Consistent);
            assert!(read.pairs.is_empty() && read.history.is_empty());
        },
    );
}

#[test]
fn an_error_on_one_rank_is_returned_on_all() {
    on_ranks(
        "an_error_on_one_rank_is_returned_on_all",
        &[3],
        |world, directory| {
            // One rank has a field of the wrong length.
            let (mut piece, run) = (piece(world.rank()), run_info(Units::Si));
            if world.rank() == 2 {
                piece.point_fields[1].values.pop();
            }
            let file = ResultFile { piece: &piece, pairs: &[], history: &[], run: &run };
            let e = write(world, &directory.join(RESULT), &file).unwrap_err();
            assert!(e.to_string().contains("\"stress\" has the wrong length"), "{e}");
            // One rank has a field of another name.
            if world.rank() == 2 {
                piece.point_fields[1].values.push(0.0);
                piece.point_fields[0].name = "other".into();
            }
            let file = ResultFile { piece: &piece, pairs: &[], history: &[], run: &run };
            let e = write(world, &directory.join(RESULT), &file).unwrap_err();
            assert!(e.to_string().contains("differ between ranks"), "{e}");
            // The directory is not there: wrong input.
            let e = write_standard(world, &directory.join("absent").join(RESULT)).unwrap_err();
            assert_eq!(e.exit_code(), 2, "{e}");
            // The directory cannot be made.
            std::fs::write(directory.join("file"), "").unwrap();
            let e = prepare(world, &directory.join("file/results")).unwrap_err();
            assert_eq!(e.exit_code(), 2, "{e}");
        },
        |directory, _| assert_eq!(names(directory), ["file"]),
    );
}

/// A piece of some megabytes per rank.
fn big_piece(n: usize) -> Piece {
    let field = Field { name: "stress".into(), unit: "Pa", components: 6, values: vec![1.0; 6 * n] };
    Piece { points: vec![[0.0; 3]; n], point_fields: vec![field], ..Piece::default() }
}

/// Caps the size of files this process can write: what a full disk is, for one rank only. `None`: no cap.
fn limit_file_size(bytes: Option<u64>) {
    let limit =
        libc::rlimit { rlim_cur: bytes.unwrap_or(libc::RLIM_INFINITY), rlim_max: libc::RLIM_INFINITY };
    // SAFETY: plain system calls; the signal that would end the process is ignored, so that writing fails.
    unsafe {
        libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
        assert_eq!(libc::setrlimit(libc::RLIMIT_FSIZE, &limit), 0);
    }
}

#[test]
fn a_full_disk_ends_all_ranks_alike() {
    on_ranks(
        "a_full_disk_ends_all_ranks_alike",
        &[3],
        |world, directory| {
            let path = directory.join(RESULT);
            write_standard(world, &path).unwrap();
            let (piece, run) = (big_piece(200_000), run_info(Units::Si));
            let file = ResultFile { piece: &piece, pairs: &[], history: &[], run: &run };
            // Rank 0 cannot make the file as long as it must be; the others fail in the middle of their rows.
            for full in [2, 1, 0] {
                limit_file_size((world.rank() == full).then_some(2_000_000));
                let e = write(world, &path, &file).unwrap_err();
                assert_eq!(e.exit_code(), 1, "{e}");
                assert!(e.to_string().contains("cannot write"), "{e}");
            }
        },
        // The old file is as it was, and nothing else is left.
        |directory, _| {
            check_standard(&directory.join(RESULT), 3);
            assert_eq!(names(directory), [RESULT]);
        },
    );
}

/// Files are written one after the other until a rank is killed in the middle of one.
#[test]
fn a_killed_run_leaves_no_file_that_looks_complete() {
    const NAME: &str = "a_killed_run_leaves_no_file_that_looks_complete";
    if std::env::var_os("KONTAKT_TEST_DIR").is_some() {
        on_ranks(
            NAME,
            &[],
            |world, directory| {
                std::fs::write(
                    directory.join(format!("pid{}", world.rank())),
                    std::process::id().to_string(),
                )
                .unwrap();
                world.barrier();
                let (piece, run) = (big_piece(200_000), run_info(Units::Si));
                let file = ResultFile { piece: &piece, pairs: &[], history: &[], run: &run };
                loop {
                    write(world, &directory.join(RESULT), &file).unwrap();
                }
            },
            |_, _| {},
        );
        return;
    }
    // A kill that falls between two files tests nothing and is tried again.
    let mut left = vec![(0, false), (1, false), (0, true), (1, true)];
    for _ in 0..40 {
        let Some(&(rank, wait_for_old)) = left.last() else { return };
        let directory = tempfile::tempdir().unwrap();
        let (result, part) =
            (directory.path().join(RESULT), directory.path().join(format!(".{RESULT}.part")));
        let mut run =
            child(NAME, 2, directory.path()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let half_written = || std::fs::metadata(&part).is_ok_and(|m| m.len() > 1_000_000);
        while !half_written() || (wait_for_old && !result.exists()) {
            assert!(run.try_wait().unwrap().is_none(), "the writer ended by itself");
            std::thread::yield_now();
        }
        let pid = std::fs::read_to_string(directory.path().join(format!("pid{rank}"))).unwrap();
        // SAFETY: a signal to the process of that rank, which only ends by it.
        unsafe { libc::kill(pid.parse().unwrap(), libc::SIGKILL) };
        assert!(!run.wait().unwrap().success());
        if !part.exists() || result.exists() != wait_for_old {
            continue;
        }
        left.pop();
        if wait_for_old {
            assert_eq!(Results::read(&result).unwrap().piece.points.len(), 400_000);
        }
    }
    assert!(left.is_empty(), "no kill fell into the writing of a file");
}

/// One file after the other grows by steps until a rank is killed: what is there can be read, with the steps that are
/// counted.
#[test]
fn a_killed_run_leaves_the_steps_that_it_has_written() {
    const NAME: &str = "a_killed_run_leaves_the_steps_that_it_has_written";
    if std::env::var_os("KONTAKT_TEST_DIR").is_some() {
        on_ranks(
            NAME,
            &[],
            |world, directory| {
                let pid = directory.join(format!("pid{}", world.rank()));
                std::fs::write(pid, std::process::id().to_string()).unwrap();
                world.barrier();
                loop {
                    grow(world, &directory.join(RESULT), true, 3);
                }
            },
            |_, _| {},
        );
        return;
    }
    let mut unfinished = 0;
    for round in 0..24 {
        let directory = tempfile::tempdir().unwrap();
        let result = directory.path().join(RESULT);
        let mut run =
            child(NAME, 2, directory.path()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        while !result.exists() {
            assert!(run.try_wait().unwrap().is_none(), "the writer ended by itself");
            std::thread::yield_now();
        }
        std::thread::sleep(std::time::Duration::from_micros(1700 * round));
        let pid = std::fs::read_to_string(directory.path().join(format!("pid{}", round % 2))).unwrap();
        // SAFETY: a signal to the process of that rank, which only ends by it.
        unsafe { libc::kill(pid.parse().unwrap(), libc::SIGKILL) };
        assert!(!run.wait().unwrap().success());
        let counted = {
            let steps = hdf5::File::open(&result).unwrap().group("VTKHDF/Steps").unwrap();
            steps.attr("NSteps").unwrap().read_scalar::<i64>().unwrap()
        };
        let read = Results::read(&result).unwrap();
        assert_eq!(read.before.len() as i64 + 1, counted);
        for (k, before) in read.before.iter().enumerate() {
            let expected = state(0, 2, k).point_fields;
            assert_eq!(before.point_fields[0].values, expected[0].values, "step {k} of {counted}");
        }
        unfinished += usize::from(!read.complete);
    }
    assert!(unfinished > 0, "no kill fell into the growth of a file");
}
