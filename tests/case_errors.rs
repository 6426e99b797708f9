//! What a wrong case file says, rule by rule, and what good files mean.
use std::path::Path;

use kontakt::case::{
    self, BodyRef, Case, ContactGeometry, Driver, Gap, InsertCells, LoadKind, PlasticityCase, Property,
    Region, RigidShape, Scalar, Tangent, Temperature, Theory, Tolerance, Transfer, Weights,
};
use kontakt::{error::Error, material::Hardening};

/// A case that is right; the tests change one thing in it.
const GOOD: &str = r#"analysis = "plane stress"

[material.steel]
young = "200 GPa"
poisson = 0.3
expansion = 12e-6
reference_temperature = 293

[[body]]
name = "lower"
material = "steel"
temperature = 393
mesh.rectangle.x = { from = 0, to = 0.04, cells = 4 }
mesh.rectangle.y = { from = 0, to = 0.02, cells = 2 }
[[body.support]]
surface = "bottom"
y = 0

[[body]]
name = "upper"
material = "steel"
mesh.rectangle.x = { from = 0, to = 0.04, cells = 4 }
mesh.rectangle.y = { from = 0.02, to = 0.05, cells = 3 }
[[body.load]]
surface = "top"
pressure = "100 MPa"

[[contact]]
name = "main"
surfaces = ["upper.bottom", "lower.top"]
gap = 5e-5

[[probe]]
name = "A"
body = "upper"
at = [0, 0.02]

[[variant]]
name = "wide"
set = { "contact.main.gap" = 2e-4, "body.lower.mesh.rectangle.x.cells" = 10 }
[[variant]]
name = "bare"
remove = ["body.upper.load", "contact.main.gap"]
set = { "contact.main.gap_offset" = "-5 um", "body.upper.support" = [{ surface = "top", y = "-1 um" }] }
"#;

fn read_text(text: &str, variant: Option<&str>, sets: &[&str]) -> Result<Case, String> {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let file = directory.path().join("f.toml");
    std::fs::write(&file, text).expect("a temporary file");
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    let shown = format!("{}/", directory.path().display());
    case::read(&file, variant, &sets).map_err(|error| {
        assert!(matches!(error, Error::Input(_)), "{error:?}");
        assert_eq!(error.exit_code(), 2);
        error.to_string().replace(&shown, "")
    })
}

/// The good case with `old` (which must be there) replaced by `new`.
fn error_of(old: &str, new: &str) -> String {
    assert!(GOOD.contains(old), "'{old}' is not in the good case");
    match read_text(&GOOD.replacen(old, new, 1), None, &[]) {
        Ok(_) => panic!("'{new}' was accepted"),
        Err(error) => error,
    }
}

/// Checks rows of (old text, new text, error it must produce). Each row breaks one rule: one error.
fn check(rows: &[(&str, &str, &str)]) {
    for (old, new, expected) in rows {
        let error = error_of(old, new);
        assert!(error.contains(expected), "'{new}' gives\n  {error}\nnot\n  {expected}");
        assert_eq!(error.lines().count(), 1, "'{new}' gives more than one error:\n{error}");
        assert!(!error.contains("internal"), "{error}");
    }
}

#[test]
fn keys() {
    check(&[
        (
            "young =",
            "yong = 1\nyoung =",
            "f.toml:4: material.steel.yong: unknown key 'yong'; did you mean 'young'?",
        ),
        (
            "analysis",
            "gravity = 1\nanalysis",
            "f.toml:1: gravity: unknown key 'gravity'; there is: title, units",
        ),
        ("cells = 4 }", "cells = 4, cell = 3 }", "body.lower.mesh.rectangle.x.cell: unknown key 'cell'"),
        ("analysis = \"plane stress\"", "", "f.toml:1: analysis: missing; it is required"),
        ("poisson = 0.3\n", "", "f.toml:3: material.steel.poisson: missing"),
        ("material = \"steel\"", "", "f.toml:9: body.lower.material: missing"),
        ("at = [0, 0.02]", "", "probe.A.at: missing"),
        ("gap = 5e-5", "gap = 1 mm", "f.toml:31: not valid TOML"),
        ("gap = 5e-5", "gap = 1\ngap = 2", "f.toml:32: not valid TOML: duplicate key"),
    ]);
}

#[test]
fn types_and_values() {
    check(&[
        ("at = [0, 0.02]", "at = 3", "probe.A.at: 3 is an integer; an array is needed"),
        ("at = [0, 0.02]", "at = [1]", "probe.A.at: [1] was given; two values are needed, [x, y]"),
        ("at = [0, 0.02]", "at = [0, true]", "probe.A.at.1: true is a boolean; a number is needed"),
        ("gap = 5e-5", "gap = nan", "f.toml:31: contact.main.gap: nan was given; a finite number is needed"),
        ("gap = 5e-5", "gap = inf", "a finite number is needed"),
        ("cells = 4 }", "cells = 0 }", "an integer from 1 to 1000000 is needed"),
        ("cells = 4 }", "cells = 2.5 }", "2.5 is a number; a positive integer is needed"),
        ("cells = 4 }", "cells = 99999999999999 }", "an integer from 1 to 1000000 is needed"),
        ("\"plane stress\"", "\"plane stres\"", "'plane strain' is needed; did you mean 'plane stress'?"),
        (
            "[[body.support]]",
            "[body.support]",
            "body.lower.support: { surface = \"bottom\", y = 0 } is a table; an array of \
         tables is needed: write [[body.support]]",
        ),
        (
            "name = \"lower\"",
            "name = \"lower\"\nelement = \"quad9\"",
            "'quad8' is needed; did you mean 'quad4'?",
        ),
        ("analysis", "thickness = 0\nanalysis", "f.toml:1: thickness: 0 was given; must be > 0"),
        ("analysis", "thickness = -1.5\nanalysis", "thickness: -1.5 was given; must be > 0"),
        ("analysis", "units = \"si\"\nanalysis", "one of 'SI', 'consistent' is needed; did you mean 'SI'?"),
    ]);
}

#[test]
fn units() {
    check(&[
        (
            "\"200 GPa\"",
            "\"25 mm\"",
            "f.toml:4: material.steel.young: '25 mm' is a length; material.steel.young needs a \
         pressure (Pa, MPa, GPa ...)",
        ),
        ("\"200 GPa\"", "\"200 Gpa\"", "unknown unit 'Gpa'; did you mean 'GPa'?"),
        ("\"200 GPa\"", "\"stiff\"", "'stiff' is not a number with a unit"),
        (
            "temperature = 393",
            "temperature = \"20 mm\"",
            "body.lower.temperature: '20 mm' is a length; \
         body.lower.temperature needs a temperature (K, degC)",
        ),
        ("\"100 MPa\"", "\"100 N\"", "needs a pressure"),
        ("gap = 5e-5", "gap = \"20 degC\"", "'20 degC' is a temperature; contact.main.gap needs a length"),
    ]);
    let consistent =
        format!("units = \"consistent\"\n{GOOD}").replace("\"100 MPa\"", "100").replace("\"-5 um\"", "1");
    let error = read_text(&consistent, None, &[]).unwrap_err();
    let expected =
        "f.toml:5: material.steel.young: \"200 GPa\" was given; with units = \"consistent\" a number stands";
    assert!(error.contains(expected), "{error}");
    assert!(read_text(&consistent.replace("\"200 GPa\"", "2e5"), None, &[]).is_ok());
}

#[test]
fn expressions() {
    check(&[
        (
            "temperature = 393",
            "temperature = \"600 - 16000*t\"",
            "unknown variable 't'; an expression may use x, y and z",
        ),
        ("temperature = 393", "temperature = \"maximum(x, 1)\"", "unknown function 'maximum'"),
        ("temperature = 393", "temperature = \"600 - \"", "expected at the end"),
        ("temperature = 393", "temperature = \"1/0\"", "a finite number is needed"),
        ("y = 0\n", "y = \"0.1*\"\n", "body.lower.support.0.y: \"0.1*\" was given"),
    ]);
}

#[test]
fn materials() {
    let table = |text: &str| format!("young = {{ temperature = {text} }}");
    let rows = [
        ("[293, 293], value = [1, 2]", "293 follows 293; temperatures must increase"),
        ("[373, 293], value = [1, 2]", "293 follows 373; temperatures must increase"),
        ("[293, 373], value = [1]", "2 temperatures and 1 values were given"),
        ("[293], value = [1]", "at least two of each are needed"),
        ("[293, 373], value = [1, -2]", "-2 was given (value.1); must be > 0"),
        ("[293, 373], values = [1, 2]", "unknown key 'values'; did you mean 'value'?"),
        ("[293, 373], value = [\"1 GPa\", \"1 mm\"]", "'1 mm' is a length"),
    ];
    for (text, expected) in rows {
        let error = error_of("young = \"200 GPa\"", &table(text));
        assert!(error.contains(expected), "{text}: {error}");
    }
    check(&[
        ("\"200 GPa\"", "0", "material.steel.young: 0 was given; must be > 0"),
        ("\"200 GPa\"", "\"-200 GPa\"", "material.steel.young: \"-200 GPa\" was given; must be > 0"),
        (
            "poisson = 0.3",
            "poisson = 0.5",
            "poisson: 0.5 was given; must be in (-1, 0.5): nu >= 0.5 needs a mixed",
        ),
        ("poisson = 0.3", "poisson = -1", "must be in (-1, 0.5)"),
        (
            "reference_temperature = 293",
            "",
            "material.steel.reference_temperature: missing; 'expansion' needs",
        ),
        ("reference_temperature = 293", "reference_temperature = -1", "must be >= 0 K"),
        ("material = \"steel\"", "material = \"stel\"", "there is no such material; did you mean 'steel'?"),
        ("material = \"steel\"", "material = 3", "the name of a material, or a table, is needed"),
        ("material = \"steel\"", "material = { file = \"m.toml\", name = \"a\" }", "there is no file m.toml"),
        (
            "expansion = 12e-6\nreference_temperature = 293\n",
            "",
            "temperature needs 'expansion' in the material (steel)",
        ),
        (
            "poisson = 0.3\n",
            "poisson = { temperature = [293, 373], value = [0.3, 0.31] }\n",
            "body.upper.temperature: missing; the material (steel) has tables over temperature: at which",
        ),
        ("temperature = 393", "temperature = -1", "must be >= 0 K"),
    ]);
}

/// Checks rows of (keys of the plasticity of the material, error they must produce).
fn check_plasticity(rows: &[(&str, &str)]) {
    let end = "reference_temperature = 293\n";
    for (text, expected) in rows {
        let new = format!("{end}[material.steel.plasticity]\n{text}\n");
        check(&[(end, &new, expected)]);
    }
}

#[test]
fn materials_that_yield() {
    check_plasticity(&[
        ("", "f.toml:8: material.steel.plasticity: none given; exactly one of yield_stress, curve, curves,"),
        ("hardening = 1", "f.toml:9: material.steel.plasticity.hardening: goes with 'yield_stress'"),
        ("yield_stress = 0", "f.toml:9: material.steel.plasticity.yield_stress: 0 was given; must be > 0"),
        (
            "yield_stress = \"3 mm\"",
            "'3 mm' is a length; material.steel.plasticity.yield_stress needs a pressure",
        ),
        ("yield_stres = 3e8\nyield_stress = 3e8", "unknown key 'yield_stres'; did you mean 'yield_stress'?"),
        ("yield_stress = 3e8\nhardening = -1", "hardening: -1 was given; must be >= 0: softening gathers"),
        (
            "yield_stress = 3e8\npower = { yield_stress = 3e8, strain = 0.01, exponent = 0.2 }",
            "yield_stress and power given; exactly one of",
        ),
        (
            "yield_stress = { temperature = [293, 373], value = [3e8, 0] }",
            "plasticity.yield_stress.value: 0 was given (value.1); must be > 0",
        ),
        (
            "yield_stress = { temperature = [293, 373], value = [3e8, 2e8] }",
            "body.upper.temperature: missing; the material (steel) has tables over temperature: at which",
        ),
        (
            "hardening = 1e9\ncurve = { plastic_strain = [0, 0.1], stress = [3e8, 4e8] }",
            "plasticity.hardening: goes with 'yield_stress'",
        ),
    ]);
}

#[test]
fn curves_of_yield_stress() {
    let curve =
        |text: &str, expected: &str| check_plasticity(&[(&format!("curve = {{ {text} }}"), expected)]);
    curve("plastic_strain = [0, 0.1]", "plasticity.curve.stress: missing; it is required");
    curve(
        "plastic_strain = [0, 0.1], stress = [3e8]",
        "2 plastic strains and 1 stresses were given; at least two",
    );
    curve("plastic_strain = [0], stress = [3e8]", "at least two of each are needed");
    curve("plastic_strain = [0.001, 0.1], stress = [3e8, 4e8]", "it begins at 0.001; the first must be 0");
    curve(
        "plastic_strain = [0, 0.1, 0.1], stress = [3e8, 4e8, 5e8]",
        "0.1 follows 0.1; plastic strains must increase",
    );
    curve(
        "plastic_strain = [0, 0.1], stress = [0, 4e8]",
        "plasticity.curve.stress: 0 was given; must be > 0",
    );
    curve(
        "plastic_strain = [0, 0.1], stress = [3e8, 2e8]",
        "curve.stress: 200000000 follows 300000000; it must not fall: softening gathers in one row of cells",
    );
    let one = "{ temperature = 293, plastic_strain = [0, 0.1], stress = [3e8, 4e8] }";
    check_plasticity(&[
        (&format!("curves = [{one}]"), "at least two are needed; one for all temperatures is 'curve'"),
        (
            &format!("curves = [{one}, {one}]"),
            "curves.1.temperature: 293 follows 293; temperatures must increase",
        ),
        (&format!("curves = {one}"), "is a table; an array of tables is needed"),
        (
            &format!("curves = [{one}, {}]", one.replace("293", "373").replace("[0,", "[1e-4,")),
            "plasticity.curves.1.plastic_strain: it begins at 0.0001; the first must be 0",
        ),
        (&format!("curves = [{one}, {}]", one.replace("293", "-373")), "must be >= 0 K"),
        (
            &format!("curves = [{one}, {}]", one.replace("293", "373")),
            "body.upper.temperature: missing; the material (steel) has tables over temperature",
        ),
    ]);
}

#[test]
fn laws_of_hardening() {
    let law = |name: &str, keys: &str| format!("{name} = {{ yield_stress = 3e8, {keys} }}");
    check_plasticity(&[
        (&law("ramberg_osgood", "offset = 0.002"), "ramberg_osgood.exponent: missing; it is required"),
        (&law("ramberg_osgood", "exponent = 1"), "ramberg_osgood.exponent: 1 was given; must be > 1"),
        (
            &law("ramberg_osgood", "exponent = 9, offset = 0"),
            "ramberg_osgood.offset: 0 was given; must be > 0",
        ),
        (&law("power", "exponent = 0.2"), "power.strain: missing; it is required"),
        (&law("power", "exponent = 0.2, strain = 0"), "power.strain: 0 was given; must be > 0"),
        (&law("power", "exponent = 1.5, strain = 1"), "power.exponent: 1.5 was given; must be in (0, 1]"),
        ("yield_stress = 3e8\npowr = 1", "unknown key 'powr'; did you mean 'power'?"),
        ("yield_stress = 3e8\nkinematic.recall = 3", "kinematic.modulus: missing; it is required"),
        ("yield_stress = 3e8\nkinematic.modulus = 0", "kinematic.modulus: 0 was given; must be > 0"),
        (
            "yield_stress = 3e8\nkinematic = { modulus = 1e9, recall = -1 }",
            "kinematic.recall: -1 was given; must be >= 0",
        ),
    ]);
}

#[test]
fn how_yielding_is_computed() {
    let at = "[[contact]]";
    let rows = [
        (
            "theory = \"flwo\"",
            "plasticity.theory: \"flwo\" was given; one of 'flow', 'deformation' is needed; did you mean 'flow'?",
        ),
        (
            "iteration = \"secant\"",
            "plasticity.iteration: \"secant\" was given; secant moduli are those of theory = \"deformation\"",
        ),
        ("tolerance = 0", "plasticity.tolerance: 0 was given; must be > 0 and < 1e-2"),
        ("tolerance = 0.01", "must be > 0 and < 1e-2"),
        ("max_iterations = 0", "an integer from 1 to 1000000 is needed"),
        (
            "zone = \"some\"",
            "plasticity.zone: \"some\" was given; one of 'automatic', 'always', 'never' is needed",
        ),
        ("teory = \"flow\"", "plasticity.teory: unknown key 'teory'; did you mean 'theory'?"),
    ];
    for (text, expected) in rows {
        check(&[(at, &format!("[plasticity]\n{text}\n{at}"), expected)]);
    }
    let drawn = "field = \"equivalent plastic strain\"";
    let rows = [
        (drawn.to_string(), "output.field: no body has a material with 'plasticity', so that nothing yields"),
        (
            format!("{drawn}\nstress = \"xx\""),
            "output.field: 'stress' is given as well; the picture has one of them",
        ),
    ];
    for (text, expected) in rows {
        check(&[(at, &format!("[output]\n{text}\n{at}"), expected)]);
    }
    let moving =
        "reference_temperature = 293\nplasticity = { yield_stress = 3e8, kinematic.modulus = 1e9 }\n";
    let text = GOOD.replacen("reference_temperature = 293\n", moving, 1);
    assert!(read_text(&text, None, &[]).is_ok());
    let error = read_text(&text, None, &["plasticity.theory=deformation"]).unwrap_err();
    assert!(
        error.contains(
            "--set: plasticity.theory: \"deformation\" was given; the material 'steel' of body 'lower'"
        ),
        "{error}"
    );
    assert!(error.contains("backstress is a matter of flow") && error.lines().count() == 1, "{error}");
}

#[test]
fn inserts() {
    let at = "[[body.support]]\n";
    let insert =
        |text: &str, expected: &str| check(&[(at, &format!("[[body.insert]]\n{text}\n{at}"), expected)]);
    insert(
        "material = \"steel\"",
        "f.toml:15: body.lower.insert.0: exactly one of 'group' and 'within' is needed",
    );
    insert("material = \"steel\"\ngroup = \"a\"\nwithin.x = [0, 1]", "exactly one of 'group' and 'within'");
    insert("within.x = [0, 1]", "body.lower.insert.0.material: missing; it is required");
    insert("material = \"stel\"\nwithin.x = [0, 1]", "there is no such material; did you mean 'steel'?");
    insert(
        "material = \"steel\"\ngroup = \"a\"",
        "group: \"a\" was given; a generated mesh has no physical groups",
    );
    insert("material = \"steel\"\nwithin = {}", "insert.0.within: names no direction");
    insert("material = \"steel\"\nwithin.x = [1, 0]", "within.x: two numbers are needed, the smaller first");
    insert("material = \"steel\"\nwithin.x = [0, 1]\nname = 1", "unknown key 'name'");
    let other = |keys: &str| format!("material = {{ young = 1e9, poisson = 0.3{keys} }}\nwithin.x = [0, 1]");
    insert(&other(""), "temperature needs 'expansion' in the material (material of body.lower.insert.0)");
    insert(
        &other(", expansion = 1e-5, reference_temperature = 300"),
        "body.lower.temperature: the materials of a body with a temperature need one 'reference_temperature', from which all of it \
         is heated; there are 293 of 'steel' and 300 of 'material of body.lower.insert.0'",
    );
    let unheated = "[[body.load]]\n";
    check(&[(
        unheated,
        &format!(
            "[[body.insert]]\nwithin.x = [0, 1]\nmaterial = {{ young = {{ temperature = [1, 2], value = [1, 2] }}, poisson = 0 }}\n{unheated}"
        ),
        "body.upper.temperature: missing; the material (material of body.upper.insert.0) has tables",
    )]);
    check(&[(
        "name = \"upper\"\n",
        "name = \"upper\"\ninsert = 3\n",
        "body.upper.insert: 3 is an integer; an array of tables is needed: write [[body.insert]]",
    )]);
}

/// The lower body's left half of a metal that yields, and how it is computed, changed from outside.
#[test]
fn what_yields_arrives_and_is_changed() {
    let more = "[[body.insert]]\nmaterial = \"soft\"\nwithin.x = [0, 0.02]\n[[body.support]]\n";
    let soft = "[material.soft]\nyoung = 1e9\npoisson = 0.3\nexpansion = 1e-5\nreference_temperature = 293\n\
                plasticity.curve = { plastic_strain = [0, \"1 %\"], stress = [\"10 MPa\", 2e7] }\n[[body]]\n";
    let text = GOOD.replacen("[[body.support]]\n", more, 1).replacen("[[body]]\n", soft, 1);
    let case = read_text(&text, None, &[]).unwrap();
    let [insert] = &case.bodies[0].inserts[..] else { panic!("one insert") };
    let low = [0.0, f64::NEG_INFINITY, f64::NEG_INFINITY];
    let high = [0.02, f64::INFINITY, f64::INFINITY];
    assert_eq!(insert.cells, InsertCells::Within([low, high]));
    let curve = |factor: f64| Hardening::Table(vec![(0.0, vec![(0.0, 1e7 * factor), (0.01, 2e7 * factor)])]);
    let hardening = |case: &Case| case.bodies[0].inserts[0].material.plasticity.clone().unwrap().hardening;
    assert_eq!(hardening(&case), curve(1.0));
    assert_eq!(
        (case.has_plasticity(), case.bodies[0].yields(), case.bodies[1].yields()),
        (true, true, false)
    );
    assert_eq!(case.plasticity, PlasticityCase::default());

    let scaled = case.rescaled(1e3, 1e-6);
    assert_eq!(hardening(&scaled), curve(1e-6));
    let moved = case.translated(1.0, 0.0).unwrap();
    let InsertCells::Within([low, high]) = moved.bodies[0].inserts[0].cells else { panic!("box") };
    assert_eq!((low[0], high[0], high[1]), (1.0, 1.02, f64::INFINITY));
    assert!(case.rotated(1.0).is_err());

    let sets = [
        "plasticity.theory=deformation",
        "plasticity.iteration=secant",
        "material.steel.plasticity.yield_stress=300 MPa",
        "body.lower.insert.0.material=steel",
    ];
    let set = read_text(&text, None, &sets).unwrap();
    assert_eq!((set.plasticity.theory, set.plasticity.tangent), (Theory::Deformation, Tangent::Secant));
    assert_eq!(set.plasticity.max_iterations, 1000);
    let linear =
        Hardening::Linear { yield_stress: Property::Constant(3e8), modulus: Property::Constant(0.0) };
    assert_eq!(hardening(&set), linear);
    assert!(set.bodies[1].yields() && set.fingerprint != case.fingerprint);
    let variant = "[[variant]]\nname = \"wide\"\nset = { \"material.soft.plasticity\" = { power = { yield_stress = 1e7, strain = 0.01, exponent = 0.5 } }, ";
    let text = text.replacen("[[variant]]\nname = \"wide\"\nset = { ", variant, 1);
    let power = Hardening::Power { yield_stress: Property::Constant(1e7), strain: 0.01, exponent: 0.5 };
    assert_eq!(hardening(&read_text(&text, Some("wide"), &[]).unwrap()), power);
}

/// `cases/materials.toml` is read by every case that names one of its materials.
#[test]
fn every_material_of_the_library_is_one_of_a_body() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/materials.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let names: Vec<&str> = text
        .lines()
        .filter_map(|line| line.strip_prefix("[material.")?.strip_suffix(']'))
        .filter(|name| !name.contains('.'))
        .collect();
    assert_eq!(names[0], "40Kh");
    assert!(names.len() > 6, "{names:?}");
    for name in names {
        let reference = format!("material = {{ file = \"{}\", name = \"{name}\" }}", file.display());
        let text = GOOD.replacen("material = \"steel\"", &reference, 1);
        let case = read_text(&text, None, &[]).unwrap_or_else(|error| panic!("{name}: {error}"));
        let material = &case.bodies[0].material;
        assert!(material.plasticity.is_some() && material.expansion.is_some(), "{name}");
        let stiff = [293.0, 373.0].map(|t| material.young.at(t));
        assert!(stiff.iter().all(|e| (60e9..220e9).contains(e)), "{name}: {stiff:?}");
    }
}

#[test]
fn names() {
    check(&[
        (
            "[[probe]]",
            "[[probe]]\nname = \"A\"\nbody = \"lower\"\nat = [0, 0]\n[[probe]]",
            "there are two probes named 'A'; the first is in line",
        ),
        (
            "[[contact]]",
            "[[contact]]\nname = \"main\"\nsurfaces = [\"upper.left\", \"lower.left\"]\n[[contact]]",
            "there are two contacts named 'main'",
        ),
        ("name = \"bare\"", "name = \"wide\"", "there are two variants named 'wide'"),
        ("body = \"upper\"", "body = \"uper\"", "there is no body 'uper'; did you mean 'upper'?"),
        ("name = \"A\"", "name = \"A.1\"", "\"A.1\" was given; a name is made of"),
    ]);
    // A wrong name of a body makes what refers to the body wrong, too.
    for (name, expected) in [
        ("upper", "there are two bodies named 'upper'; the first is in line 9"),
        ("lo wer", "f.toml:10: body.lo wer.name: \"lo wer\" was given; a name is made of"),
        ("", "f.toml:10: body.0.name: \"\" was given; a name is made of"),
    ] {
        let error = error_of("name = \"lower\"", &format!("name = \"{name}\""));
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn supports_and_loads() {
    check(&[
        (
            "surface = \"bottom\"\ny = 0",
            "surface = \"bottom\"",
            "body.lower.support.0: a support needs 'x' or 'y'",
        ),
        ("surface = \"bottom\"\ny = 0", "y = 0", "a support needs a 'surface' or a 'point'"),
        (
            "surface = \"bottom\"\ny = 0",
            "surface = \"botom\"\ny = 0",
            "body.lower.support.0.surface: there is no surface 'botom'; did you mean 'bottom'?",
        ),
        ("surface = \"bottom\"\ny = 0", "surface = \"bottom\"\npoint = [0, 0]\ny = 0", "exclude each other"),
        (
            "surface = \"bottom\"\ny = 0",
            "point = [0, 0]\ny = 0\nwithin = { x = [0, 1] }",
            "goes with 'surface'",
        ),
        (
            "surface = \"bottom\"\ny = 0",
            "surface = \"bottom\"\ny = 0\nwithin = { x = [1, 0] }",
            "the smaller first",
        ),
        ("surface = \"bottom\"\ny = 0", "surface = \"bottom\"\ny = 0\nwithin = { }", "names no direction"),
        ("surface = \"top\"\n", "", "'pressure' needs a 'surface' to act on"),
        ("surface = \"top\"\n", "point = [0, 0]\n", "'pressure' acts on a 'surface', not at a 'point'"),
        (
            "surface = \"top\"\n",
            "surface = \"front\"\n",
            "there is no surface 'front'; there is: left, right, bottom, top",
        ),
        ("pressure = \"100 MPa\"", "", "no kind of load given; a load has exactly one of pressure, traction"),
        (
            "pressure = \"100 MPa\"",
            "pressure = 1\nforce = [0, 1]",
            "pressure and force given; a load has exactly one",
        ),
        ("pressure = \"100 MPa\"", "body_force = [0, 1]", "'body_force' acts everywhere"),
        (
            "surface = \"top\"\npressure = \"100 MPa\"",
            "force = [0, 1]",
            "'force' needs a 'surface' or a 'point'",
        ),
        ("name = \"upper\"", "name = \"upper\"\nsolver = \"cg\"", "PETSc options begin with '-'"),
        (
            "name = \"upper\"",
            "name = \"upper\"\nformulation = \"reduced\"",
            "\"reduced\" was given; quad4 has enhanced, standard",
        ),
        (
            "name = \"upper\"",
            "name = \"upper\"\nelement = \"tri3\"\nformulation = \"enhanced\"",
            "tri3 has standard",
        ),
    ]);
}

#[test]
fn contacts() {
    let surfaces = "[\"upper.bottom\", \"lower.top\"]";
    check(&[
        (
            surfaces,
            "[\"uper.bottom\", \"lower.top\"]",
            "contact.main.surfaces: [\"uper.bottom\", \"lower.top\"] was given; \
         there is no body 'uper'; did you mean 'upper'?",
        ),
        (
            surfaces,
            "[\"upper.botom\", \"lower.top\"]",
            "on body 'upper' there is no surface 'botom'; did you mean 'bottom'?",
        ),
        (surfaces, "[\"upper\", \"lower.top\"]", "'upper' was given; a surface is written \"body.surface\""),
        (surfaces, "[\"upper.bottom\"]", "two surfaces are needed"),
        (surfaces, "[\"upper.bottom\", \"upper.bottom\"]", "a surface cannot be in contact with itself"),
        (surfaces, "[\"upper.bottom\", \"upper.top\"]", "must belong to different bodies"),
        ("gap = 5e-5", "gap = 5e-5\ngap_offset = 1", "give one of the two"),
        ("gap = 5e-5", "search_distance = 0", "search_distance: 0 was given; must be > 0"),
        ("gap = 5e-5", "conjugate = \"nearest\"", "one of 'closest point', 'intersection' is needed"),
        ("gap = 5e-5", "friction = -0.1", "friction: -0.1 was given; must be >= 0"),
        (
            "gap = 5e-5",
            "friction = { temperature = [293, 593], value = [0.3, -0.1] }",
            "f.toml:31: contact.main.friction.value: -0.1 was given (value.1); must be >= 0",
        ),
        (
            "gap = 5e-5",
            "friction = { temperature = [593, 293], value = [0.3, 0.1] }",
            "293 follows 593; temperatures must increase",
        ),
        (
            "gap = 5e-5",
            "law = \"tresca\"\nshear = { temperature = [293, 593], value = [1e6, 0] }",
            "f.toml:32: contact.main.shear.value: 0 was given (value.1); must be > 0",
        ),
        ("gap = 5e-5", "frictoin = 0.1", "did you mean 'friction'?"),
        ("gap = 5e-5", "law = \"colomb\"\nfriction = 0.1", "did you mean 'coulomb'?"),
        ("gap = 5e-5", "law = \"coulomb\"", "law = \"coulomb\" needs 'friction'"),
        ("gap = 5e-5", "law = \"tresca\"", "law = \"tresca\" needs 'shear'"),
        ("gap = 5e-5", "law = \"rough\"\nfriction = 0.1", "'friction' belongs to law = \"coulomb\""),
        ("gap = 5e-5", "friction = 0.1\nshear = 1e6", "'shear' belongs to law = \"tresca\""),
        ("gap = 5e-5", "law = \"tresca\"\nshear = 0", "shear: 0 was given; must be > 0"),
        (
            "[[contact]]",
            "[alternation]\ndriver = \"relaxed\"\nweights = 1\n[[contact]]",
            "1 was given; a constant weight must be in (0, 1)",
        ),
        (
            "[[contact]]",
            "[alternation]\ndriver = \"relaxed\"\nweights = 0.0\n[[contact]]",
            "a constant weight must be in (0, 1)",
        ),
        (
            "[[contact]]",
            "[alternation]\ndriver = \"relaxed\"\nweights = \"respons\"\n[[contact]]",
            "did you mean 'response'?",
        ),
        (
            "[[contact]]",
            "[alternation]\ntolerance = 0\n[[contact]]",
            "alternation.tolerance: 0 was given; must be in",
        ),
        ("[[contact]]", "[alternation]\ntolerance = 0.02\n[[contact]]", "must be in (0, 1e-2]"),
        (
            "[[contact]]",
            "[alternation]\ntolerance = \"automatic\"\n[[contact]]",
            "\"automatic\" was given; there is: auto or a number",
        ),
        ("[[contact]]", "[alternation]\nmax_alternations = 0\n[[contact]]", "an integer from 1"),
        ("[[contact]]", "[output]\nstress = \"mises\"\n[[contact]]", "'von Mises' is needed"),
        (
            "[[contact]]",
            "[output]\nwindow = [[1, 1], [0, 0]]\n[[contact]]",
            "the lower and then the upper corner",
        ),
        ("[[contact]]", "[output]\nmagnification = -1\n[[contact]]", "must be >= 0"),
    ]);
}

/// Friction is settled on compliances, which a body that answers by its solver does not have.
#[test]
fn friction_over_temperature_needs_one() {
    const TABLE: &str = "{ temperature = [293, 593], value = [0.3, 0.1] }";
    for law in [format!("friction = {TABLE}"), format!("law = \"tresca\"\nshear = {TABLE}")] {
        let text = GOOD.replace("gap = 5e-5", &law);
        let case = read_text(&text, None, &[]).expect("one body is heated");
        assert_eq!(
            case.contacts[0].over_temperature,
            Some(Property::Table(vec![(293.0, 0.3), (593.0, 0.1)]))
        );
        let error = read_text(&text.replace("temperature = 393\n", ""), None, &[]).unwrap_err();
        let key = if law.starts_with("law") { "31: contact.main.shear" } else { "30: contact.main.friction" };
        let rule = "a table over temperature needs a body with a 'temperature'";
        assert!(error.contains(&format!("f.toml:{key}: {rule}")), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

#[test]
fn drivers() {
    let contact = "[[contact]]\nname = \"main\"\n";
    let with = |alternation: &str, own: &str| format!("[alternation]\n{alternation}\n{contact}{own}\n");
    for (alternation, own, expected) in [
        (
            "driver = \"activ set\"\nweights = 3",
            "conjugate = \"intersection\"",
            "f.toml:29: alternation.driver: \"activ set\" was given; one of 'active set', 'relaxed' is needed; did you \
             mean 'active set'?",
        ),
        (
            "weights = 0.5",
            "",
            "f.toml:29: alternation.weights: 0.5 was given; weights belong to driver = \"relaxed\"; the driver",
        ),
        (
            "driver = \"active set\"\nweights = \"nonsense\"",
            "",
            "alternation.weights: \"nonsense\" was given; weights belong to driver = \"relaxed\"",
        ),
        ("transfer = \"morter\"", "", "one of 'mortar', 'pointwise' is needed; did you mean 'mortar'?"),
        (
            "driver = \"relaxed\"",
            "friction = 0.3\ngeometry = \"updated\"",
            "f.toml:33: contact.main.geometry: driver = \"relaxed\" with transfer = \"pointwise\", its default, has friction \
             where nodes match",
        ),
        ("", "geometry = \"update\"", "one of 'initial', 'updated' is needed; did you mean 'updated'?"),
        (
            "",
            "conjugate = \"intersection\"",
            "contact.main.conjugate: \"intersection\" was given; 'conjugate' belongs to transfer = \"pointwise\"",
        ),
        (
            "",
            "conjugate = \"closest point\"",
            "contact.main.conjugate: \"closest point\" was given; 'conjugate' belongs to transfer = \"pointwise\"",
        ),
    ] {
        check(&[(contact, &with(alternation, own), expected)]);
    }
    check(&[(
        "name = \"upper\"",
        "name = \"upper\"\nresponse = \"dense\"",
        "body.upper.response: \"dense\" was given; one of 'automatic', 'condensed', 'solver' is needed",
    )]);
    for (alternation, own, driver, transfer, limit) in [
        ("", "geometry = \"updated\"", Driver::ActiveSet, Transfer::Mortar, 1000),
        (
            "transfer = \"pointwise\"",
            "conjugate = \"intersection\"\ngeometry = \"updated\"",
            Driver::ActiveSet,
            Transfer::Pointwise,
            1000,
        ),
        (
            "driver = \"relaxed\"",
            "conjugate = \"intersection\"",
            Driver::Relaxed(Weights::Response),
            Transfer::Pointwise,
            200,
        ),
        (
            "driver = \"relaxed\"\ntransfer = \"mortar\"",
            "geometry = \"updated\"",
            Driver::Relaxed(Weights::Response),
            Transfer::Mortar,
            200,
        ),
    ] {
        let case = read_text(&GOOD.replace(contact, &with(alternation, own)), None, &[]).unwrap();
        let found = &case.alternation;
        assert_eq!((found.driver, found.transfer, found.max_alternations), (driver, transfer, limit));
        let updated = case.contacts[0].geometry == ContactGeometry::Updated;
        assert_eq!(updated, own.contains("updated"));
    }
    let plain = read_text(GOOD, None, &[]).unwrap();
    assert_eq!(plain.alternation, Default::default());
}

/// A rigid body below the good case's, in contact with it.
const ANVIL: &str = r#"
[[body]]
name = "anvil"
rigid.plane = { through = [0, -0.01], normal = [0, 2] }
rigid.y = "1 mm"

[[contact]]
name = "base"
surfaces = ["lower.bottom", "anvil.surface"]

[[variant]]"#;

#[test]
fn rigid_bodies() {
    let with = |old: &str, new: &str| {
        assert!(ANVIL.contains(old), "'{old}' is not in the rigid body");
        ANVIL.replacen(old, new, 1)
    };
    let plane = "rigid.plane = { through = [0, -0.01], normal = [0, 2] }";
    for (old, new, expected) in [
        (plane, "", "body.anvil.rigid: none given; exactly one of plane, circle, polyline is needed"),
        (
            &format!("{plane}\nrigid.y = \"1 mm\""),
            "rigid = 3",
            "f.toml:41: body.anvil.rigid: 3 is an integer; a table is needed",
        ),
        (
            plane,
            &format!("{plane}\nrigid.circle = {{ center = [0, 0], radius = 1 }}"),
            "body.anvil.rigid: plane and circle given; exactly one of",
        ),
        ("plane =", "plan =", "body.anvil.rigid.plan: unknown key 'plan'; did you mean 'plane'?"),
        ("through = [0, -0.01], ", "", "body.anvil.rigid.plane.through: missing"),
        (
            "[0, 2]",
            "[0, 0]",
            "body.anvil.rigid.plane.normal: [0, 0] was given; a normal must have a length > 0",
        ),
        (
            "[0, 2]",
            "[\"1 mm\", 0]",
            "'1 mm' is a length; body.anvil.rigid.plane.normal.0 needs a pure number",
        ),
        ("\"1 mm\"", "\"1 K\"", "f.toml:42: body.anvil.rigid.y: '1 K' is a temperature"),
        ("\"1 mm\"", "\"x\"", "body.anvil.rigid.y: 'x' is not a number with a unit"),
        (
            plane,
            "rigid.circle = { center = [0, 0], radius = 0 }",
            "body.anvil.rigid.circle.radius: 0 was given; must be > 0",
        ),
        (
            plane,
            "rigid.circle = { center = [0, 0], radius = 1, inside = \"yes\" }",
            "body.anvil.rigid.circle.inside: \"yes\" is a string; true or false is needed",
        ),
        (
            plane,
            "rigid.polyline = { points = [[0, 0]] }",
            "body.anvil.rigid.polyline.points: [[0, 0]] was given; at least two points are needed",
        ),
        (plane, "rigid.polyline = { points = [[0, 0], [1, 0], [1, 0]] }", "points 1 and 2 are the same"),
        (
            plane,
            "rigid.polyline = { points = [[0, 0], [1, 0], [0.5, 0]] }",
            "at point 1 the line turns back on",
        ),
        (
            "\"anvil.surface\"",
            "\"anvil.top\"",
            "'anvil.top' was given; on body 'anvil' there is no surface 'top'; there is: surface",
        ),
        ("name = \"anvil\"", "name = \"upper\"", "there are two bodies named 'upper'; the first is in line"),
        (
            "[[contact]]",
            "[[probe]]\nname = \"B\"\nbody = \"anvil\"\nat = [0, 0]\n[[contact]]",
            "probe.B.body: \"anvil\" was given; a rigid body has nothing to report",
        ),
        (
            "[[contact]]",
            "[[body]]\nname = \"die\"\nrigid.circle = { center = [0, 0], radius = 1 }\n[[contact]]\n\
             surfaces = [\"anvil.surface\", \"die.surface\"]\n[[contact]]",
            "contact.1.surfaces: [\"anvil.surface\", \"die.surface\"] was given; 'anvil' and 'die' are both rigid",
        ),
    ] {
        let text = GOOD.replacen("[[variant]]", &with(old, new), 1);
        let error = read_text(&text, None, &[]).unwrap_err();
        assert!(error.contains(expected), "'{new}' gives\n  {error}\nnot\n  {expected}");
        // A wrong name makes what refers to it wrong, too.
        let follows = new == "plan =" || new.contains("\"upper\"");
        assert!(error.lines().count() == 1 || follows, "'{new}' gives more than one error:\n{error}");
    }
    for (key, value) in [
        ("material", "\"steel\""),
        ("mesh", "{ disc = 3 }"),
        ("element", "\"quad4\""),
        ("formulation", "\"standard\""),
        ("temperature", "300"),
        ("support", "[]"),
        ("load", "[{ body_force = [0, 1] }]"),
        ("solver", "\"-ksp_type cg\""),
        ("response", "\"solver\""),
    ] {
        let text = GOOD.replacen("[[variant]]", &with("rigid.y", &format!("{key} = {value}\nrigid.y")), 1);
        let error = read_text(&text, None, &[]).unwrap_err();
        let expected =
            format!("f.toml:42: body.anvil.{key}: belongs to a deformable body; a rigid one has only");
        assert!(error.starts_with(&expected) && error.lines().count() == 1, "{error}");
    }
    let alone = "analysis = \"plane stress\"\nbody = [{ name = \"a\", rigid.plane = { through = [0, 0], normal = [0, 1] } }]\n";
    let error = read_text(alone, None, &[]).unwrap_err();
    assert!(
        error.starts_with("f.toml:2: body: all bodies are rigid; at least one deformable body is"),
        "{error}"
    );

    // The rigid body stands first in the file: the deformable ones keep their own count.
    let (anvil, rest) = ANVIL.split_once("[[contact]]").unwrap();
    let text = GOOD.replacen("[[body]]", &format!("{anvil}[[body]]"), 1);
    let text = text.replacen("[[variant]]", &format!("[[contact]]{rest}"), 1);
    let case = read_text(&text, None, &[]).unwrap();
    assert_eq!((case.bodies.len(), case.rigid.len(), case.probes[0].body), (2, 1, 1));
    let bodies: Vec<BodyRef> = case.contacts.iter().flat_map(|c| &c.surfaces).map(|s| s.body).collect();
    let [lower, upper, anvil] = [BodyRef::Deformable(0), BodyRef::Deformable(1), BodyRef::Rigid(0)];
    assert_eq!(bodies, [upper, lower, lower, anvil]);
    let names: Vec<&str> = bodies.iter().map(|body| case.body_name(*body)).collect();
    assert_eq!(names, ["upper", "lower", "lower", "anvil"]);
    assert_eq!(case.rigid[0].motion, [0.0, 1e-3, 0.0]);
    let normal = [0.0, 1.0, 0.0];
    assert_eq!(case.rigid[0].shape, RigidShape::Plane { through: [0.0, -0.01, 0.0], normal });
}

/// Two paths, one with a table and one given by the steps, and what follows them.
const PATHS: &str = r#"
[path.preload]
at = [0, 1]
factor = [0, 2]
[[step]]
at = 0.5
[[step]]
at = 2
paths = { heat = -0.5 }
steps = "auto"
[[contact]]"#;

fn with_paths() -> String {
    let load = "pressure = \"100 MPa\"";
    GOOD.replace("[[contact]]", PATHS)
        .replace(load, &format!("{load}\npath = \"preload\""))
        .replace("temperature = 393", "temperature = { value = 393, path = \"heat\" }")
}

#[test]
fn paths() {
    let case = read_text(&with_paths(), None, &[]).unwrap();
    let names: Vec<&str> = case.paths.iter().map(|path| path.name.as_str()).collect();
    assert_eq!(names, ["heat", "preload"]);
    assert_eq!((case.bodies[0].temperature_path, case.bodies[1].loads[0].path), (Some(0), Some(1)));
    assert_eq!((case.bodies[0].supports[0].path, case.bodies[1].temperature_path), (None, None));
    let steps: Vec<_> = case.steps.iter().map(|s| (s.at, &s.paths[..], s.increments)).collect();
    let auto = case::Increments::Automatic;
    // A path that no step has named yet is at 0; beyond its rows a table is constant.
    assert_eq!(steps, [(0.5, &[0.0, 1.0][..], case::Increments::Equal(1)), (2.0, &[-0.5, 2.0], auto)]);
    let later = read_text(&with_paths().replace("at = 0.5", "at = 0.5\npaths.heat = 3"), None, &[]).unwrap();
    assert_eq!([later.steps[0].paths[0], later.steps[1].paths[0]], [3.0, -0.5]);
    let kept =
        with_paths().replace("at = 0.5", "at = 0.5\npaths.heat = 3").replace("paths = { heat = -0.5 }\n", "");
    assert_eq!(read_text(&kept, None, &[]).unwrap().steps[1].paths[0], 3.0);
}

#[test]
fn paths_that_are_wrong() {
    for (old, new, expected) in [
        (
            "path = \"preload\"",
            "path = \"prelaod\"",
            "body.upper.load.0.path: \"prelaod\" was given; no such path is given, neither by [path.prelaod] nor by 'paths' of a [[step]]; did you mean 'preload'?",
        ),
        (
            "path = \"heat\"",
            "path = \"wind\"",
            "body.lower.temperature.path: \"wind\" was given; no such path is given, neither by [path.wind] nor by 'paths' of a [[step]]; there is: heat, preload",
        ),
        ("path = \"heat\"", "path = \"a b\"", "a name is made of letters, digits, '_' and '-'"),
        ("path = \"heat\"", "path = 3", "body.lower.temperature.path: 3 is an integer; a string is needed"),
        (
            ", path = \"heat\"",
            "",
            "step.1.paths.heat: nothing follows this path: no load, support, temperature or motion has path = \"heat\"; there is: preload",
        ),
        ("\npath = \"preload\"", "", "path.preload: nothing follows this path"),
        (
            "heat = -0.5",
            "heat = -0.5, haet = 1",
            "step.1.paths.haet: nothing follows this path: no load, support, temperature or motion has path = \"haet\"; did you mean 'heat'?",
        ),
        (
            "heat = -0.5",
            "heat = -0.5, preload = 1",
            "step.1.paths.preload: this path has a table, [path.preload]: its factor comes from 'at'",
        ),
        ("heat = -0.5", "heat = nan", "step.1.paths.heat: nan was given; a finite number is needed"),
        ("heat = -0.5", "heat = \"1 mm\"", "step.1.paths.heat: '1 mm' is a length"),
        (
            "paths = { heat = -0.5 }",
            "paths = \"heat\"\n[[step]]\nat = 3\npaths.heat = 1",
            "step.1.paths: \"heat\" is a string; a table of factors is needed, such as paths = { NAME = 0.5 }",
        ),
        (
            "at = [0, 1]\n",
            "at = [0]\n",
            "path.preload.at: [0] was given; at least two path parameters are needed",
        ),
        (
            "at = [0, 1]\n",
            "at = [1, 1]\n",
            "path.preload.at: [1, 1] was given; path parameters increase, and 1 comes after 1",
        ),
        ("at = [0, 1]\n", "at = [0, inf]\n", "path.preload.at.1: inf was given; a finite number is needed"),
        ("at = [0, 1]\n", "", "path.preload.at: missing; it is required"),
        (
            "factor = [0, 2]",
            "factor = [0, 1, 2]",
            "path.preload.factor: [0, 1, 2] was given; 3 factors for 2 path parameters; there is one for each",
        ),
        (
            "factor = [0, 2]",
            "factor = [0, nan]",
            "path.preload.factor.1: nan was given; a finite number is needed",
        ),
        (
            "factor = [0, 2]",
            "factors = [0, 2]\nfactor = [0, 2]",
            "path.preload.factors: unknown key 'factors'; did you mean 'factor'?",
        ),
        (
            "[path.preload]\nat = [0, 1]\nfactor = [0, 2]\n",
            "[path]\npreload = 3\n",
            "path.preload: 3 is an integer; a table is needed",
        ),
        (
            "at = 0.5",
            "",
            "step.0.at: missing; a [path.NAME] table needs the path parameter at the end of each step",
        ),
        (
            "at = 0.5",
            "at = 0",
            "step.0.at: 0 was given; the path parameter begins at 0 and increases from step to step; here it must be > 0",
        ),
        (
            "at = 2\n",
            "at = 0.5\n",
            "step.1.at: 0.5 was given; the path parameter begins at 0 and increases from step to step; here it must be > 0.5",
        ),
        (
            "steps = \"auto\"",
            "steps = \"many\"",
            "step.1.steps: \"many\" was given; a count of increments or \"auto\" is needed",
        ),
        (
            "steps = \"auto\"",
            "steps = 0",
            "step.1.steps: 0 was given; an integer from 1 to 1000000 is needed",
        ),
        ("steps = \"auto\"", "steps = 1.5", "step.1.steps: 1.5 is a number; a positive integer is needed"),
        (
            "value = 393",
            "value = 393, file = \"t.csv\"",
            "body.lower.temperature: exactly one of 'file' and 'value' is needed",
        ),
        ("value = 393, ", "", "body.lower.temperature: exactly one of 'file' and 'value' is needed"),
        ("value = 393", "value = -3", "body.lower.temperature.value: -3 was given; must be >= 0 K"),
        ("value = 393", "value = \"3 m\"", "body.lower.temperature.value: '3 m' is a length"),
    ] {
        let text = with_paths();
        assert!(text.contains(old), "'{old}' is not in the case");
        let error = read_text(&text.replacen(old, new, 1), None, &[]).expect_err(new);
        assert!(error.contains(expected), "'{new}' gives\n  {error}\nnot\n  {expected}");
        assert_eq!(error.lines().count(), 1, "'{new}' gives more than one error:\n{error}");
        assert!(error.contains("f.toml:") && !error.contains("internal"), "{error}");
    }
    // Without tables there is no path parameter, without steps no way.
    check(&[(
        "[[contact]]",
        "[[step]]\nat = 1\n[[contact]]",
        "step.0.at: 1 was given; 'at' is the path parameter, and there is no [path.NAME] table",
    )]);
    let text = with_paths();
    let start = text.find("[[step]]").unwrap();
    let end = text.find("[[contact]]").unwrap();
    let bare = (text[..start].to_string() + &text[end..]).replace("{ value = 393, path = \"heat\" }", "393");
    let error = read_text(&bare, None, &[]).unwrap_err();
    assert!(
        error.contains("path.preload: a path leads through the steps, and there is no [[step]]"),
        "{error}"
    );
    let still = "[[body]]\nname = \"r\"\nrigid = { plane = { through = [0, 0], normal = [0, 1] }, path = \"heat\" }\n[[contact]]";
    let error = read_text(&with_paths().replacen("[[contact]]", still, 1), None, &[]).unwrap_err();
    assert!(
        error.contains("body.r.path: scales the motion, and there is no 'x' or 'y'")
            || error.contains("body.r.rigid.path: scales the motion, and there is no 'x' or 'y'"),
        "{error}"
    );
}

#[test]
fn steps() {
    for (steps, expected) in [
        ("[[step]]\nload = 1", "step.0.load: unknown key 'load'; did you mean 'loads'?"),
        ("[[step]]\nname = \"a\"\nloads = inf", "step.a.loads: inf was given; a finite number is needed"),
        (
            "[[step]]\nsupports = \"1 mm\"",
            "step.0.supports: '1 mm' is a length; step.0.supports needs a pure number",
        ),
        ("[[step]]\ntemperature = true", "step.0.temperature: true is a boolean; a number is needed"),
        ("[[step]]\nname = \"\"", "step.0.name: \"\" was given; a name must have a letter"),
        ("[[step]]\nname = 3", "step.0.name: 3 is an integer; a string is needed"),
        (
            "[[step]]\nname = \"a\"\n[[step]]\nname = \"a\"",
            "there are two steps named 'a'; the first is in line",
        ),
        ("[step]\nloads = 1", "write [[step]]"),
    ] {
        check(&[("[[contact]]", &format!("{steps}\n[[contact]]"), expected)]);
    }
    let text =
        GOOD.replace("[[contact]]", "[[step]]\nname = \"on, 1/2\"\nloads = -0.5\n[[step]]\n[[contact]]");
    let case = read_text(&text, None, &["step.1.temperature=0"]).unwrap();
    let factors: Vec<_> =
        case.steps.iter().map(|s| (s.name.as_deref(), s.loads, s.supports, s.temperature)).collect();
    assert_eq!(factors, [(Some("on, 1/2"), -0.5, 1.0, 1.0), (None, 1.0, 1.0, 0.0)]);
    assert!(read_text(GOOD, None, &[]).unwrap().steps.is_empty());
}

#[test]
fn meshes() {
    let x = "mesh.rectangle.x = { from = 0, to = 0.04, cells = 4 }\n";
    let y = "mesh.rectangle.y = { from = 0, to = 0.02, cells = 2 }";
    let mesh = |text: &str| error_of(&format!("{x}{y}"), &format!("mesh = {{ {text} }}"));
    check(&[
        (x, "mesh.rectangle.x = { from = 0, to = 0, cells = 4 }\n", "not at least two, each larger"),
        (
            x,
            "mesh.rectangle.x = { from = 0, cells = 4 }\n",
            "mesh.rectangle.x.to: missing; give 'from', 'to' and 'cells'",
        ),
        (
            x,
            "mesh.rectangle.x = { from = 0, to = 1 }\n",
            "mesh.rectangle.x.cells: missing; give 'cells', or 'size'",
        ),
        (x, "mesh.rectangle.x = { from = 0, at = [0, 1], cells = 4 }\n", "'at' already says where"),
        (
            x,
            "mesh.rectangle.x = { at = [0, 1, 2], cells = [4] }\n",
            "2 value(s) are needed, one for each interval",
        ),
        (
            x,
            "mesh.rectangle.x = { at = [0, 1, 2], cells = 4, ratio = [1, 0] }\n",
            "ratio.1: 0 was given; must be > 0",
        ),
        (x, "mesh.rectangle.x = { at = [0, 1, 2], size = [1, 1] }\n", "3 positive sizes are needed"),
        (x, "mesh.rectangle.x = { at = [0, 1], size = [1, 1], cells = 3 }\n", "goes without 'cells'"),
        (x, "mesh.rectangle.x = { at = [0, 1], size = [1e-9, 1e-9] }\n", "at most 1000000 are allowed"),
        (x, "", "mesh.rectangle.x: missing"),
        (x, "mesh.group = \"a\"\nmesh.rectangle.x = { from = 0, to = 1, cells = 4 }\n", "belongs to 'file'"),
        (
            x,
            "mesh.file = \"a.msh\"\nmesh.rectangle.x = { from = 0, to = 1, cells = 4 }\n",
            "rectangle and file given",
        ),
    ]);
    for (text, expected) in [
        ("file = 'no.msh'", "body.lower.mesh.file: \"no.msh\" was given; there is no file no.msh"),
        (
            "file = 'no.msh', group = 3",
            "mesh.group: 3 is an integer; the name of a physical group, or an array",
        ),
        ("file = 'no.msh', group = []", "mesh.group: [] was given; at least one group is needed"),
        ("file = 'no.msh', group = ['a', 'a']", "'a' is named twice"),
        ("rotate = 3", "none given; exactly one of rectangle, block"),
        ("ring.radius = { from = 0, to = 1, cells = 2 }", "the inner radius must be > 0"),
        ("ring.angle = { from = 0, to = 400, cells = 9 }", "goes from 0 to 400 degrees; at most a full turn"),
        ("half_disc.angle = { from = 0, to = 80, cells = 9 }", "must be symmetric about 0"),
        ("half_disc.angle = { from = -90, to = 90, cells = 9 }", "inside (-90, 90)"),
        ("disc.depth = { to = 1, cells = 2 }", "to less than 1"),
        ("disc.depth = { from = 0.1, to = 0.5, cells = 2 }", "must go from 0"),
        ("disc.radius = 0", "0 was given; must be > 0"),
        ("block.corners = [[0, 0], [0, 1], [1, 1], [1, 0]]", "counter-clockwise round a convex"),
        ("block.corners = [[0, 0], [1, 0], [1, 1]]", "four points are needed"),
        ("block.v = { to = 2, cells = 1 }", "must go from 0 to 1"),
        (
            "block = { corners = [[0, 0], [1, 0], [1, 1], [0, 1]], arcs.top = [0, 0], u.cells = 1, v.cells = 1 }",
            "the centre of 'top' must be equally far from both ends of the edge",
        ),
    ] {
        // What else is missing in the table is reported, too.
        let error = mesh(text);
        assert!(error.contains(expected), "{text}: {error}");
    }
}

#[test]
fn no_body() {
    for text in ["analysis = \"plane stress\"\n", "analysis = \"plane stress\"\nbody = []\n"] {
        let error = read_text(text, None, &[]).unwrap_err();
        assert!(error.contains("body: "), "{error}");
    }
    let error = case::read(Path::new("no-such-case.toml"), None, &[]).unwrap_err().to_string();
    assert!(error.contains("no-such-case.toml: cannot be read"), "{error}");
}

#[test]
fn all_errors_are_reported_in_the_order_of_the_file() {
    let text = GOOD
        .replace("poisson = 0.3", "poisson = 0.7")
        .replace("y = 0\n", "z = 0\n")
        .replace("\"100 MPa\"", "\"1 K\"");
    let error = read_text(&text, None, &[]).unwrap_err();
    let lines: Vec<&str> = error.lines().collect();
    assert_eq!(lines.len(), 4, "{error}");
    for (line, start) in lines.iter().zip(["f.toml:5: ", "f.toml:15: ", "f.toml:17: ", "f.toml:26: "]) {
        assert!(line.starts_with(start), "{error}");
    }
}

#[test]
fn variants_and_sets() {
    let case = read_text(GOOD, None, &[]).unwrap();
    assert_eq!(case.contacts[0].gap, Gap::Value(5e-5));
    let case = read_text(GOOD, Some("wide"), &["body.lower.temperature=120 degC"]).unwrap();
    assert_eq!(case.contacts[0].gap, Gap::Value(2e-4));
    let Some(Temperature::Field(Scalar::Constant(t))) = case.bodies[0].temperature else {
        panic!("temperature")
    };
    assert!((t - 393.15).abs() < 1e-12);
    let case = read_text(GOOD, Some("bare"), &[]).unwrap();
    assert_eq!(case.contacts[0].gap, Gap::Geometry { offset: -5e-6 });
    assert_eq!((case.bodies[1].loads.len(), case.bodies[1].supports.len()), (0, 1));
    for (variant, sets, expected) in [
        (Some("wid"), vec![], "f.toml: there is no variant 'wid'; did you mean 'wide'?"),
        (
            None,
            vec!["contact.man.gap=1"],
            "--set: contact.man.gap: there is no item 'man'; did you mean 'main'?",
        ),
        (None, vec!["contact.main.gp=1"], "--set: contact.main.gp: unknown key 'gp'; did you mean 'gap'?"),
        (None, vec!["material.steel.young=\"1 mm\""], "--set: material.steel.young: '1 mm' is a length"),
        (None, vec!["contact.main.gap"], "expected PATH=VALUE"),
    ] {
        let error = read_text(GOOD, variant, &sets).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
    let error = read_text(&GOOD.replace("= 2e-4", "= \"2 K\""), Some("wide"), &[]).unwrap_err();
    assert!(error.starts_with("f.toml:40: contact.main.gap: '2 K' is a temperature"), "{error}");
}

#[test]
fn files_of_materials_and_temperatures() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    let text = GOOD
        .replacen("material = \"steel\"", "material = { file = \"m.toml\", name = \"40Kh\" }", 1)
        .replace("temperature = 393", "temperature = { file = \"t.csv\" }");
    std::fs::write(at("case.toml"), text).unwrap();
    let young = "young = { temperature = [293, 373], value = [\"214 GPa\", 211e9] }";
    let material = format!("[material.40Kh]\n{young}\npoisson = 0.3\n");
    std::fs::write(at("m.toml"), material).unwrap();
    std::fs::write(at("t.csv"), "x, y, temperature\n0, 0, 300\n0.04, 0, 400\n").unwrap();
    let case = case::read(directory.path(), None, &[]).unwrap();
    assert_eq!(case.bodies[0].material.young, Property::Table(vec![(293.0, 214e9), (373.0, 211e9)]));
    let Some(Temperature::Nodal { values, .. }) = &case.bodies[0].temperature else { panic!("nodal") };
    assert_eq!(values[1], ([0.04, 0.0, 0.0], 400.0));

    for (file, text, expected) in [
        ("t.csv", "x,y\n0,0\n", "t.csv:1: 'x,y' was given; the first line must be x,y,temperature"),
        ("t.csv", "x,y,temperature\n0,0\n", "t.csv:2: '0,0' was given; three finite numbers"),
        ("t.csv", "x,y,temperature\n0,0,-3\n", "t.csv:2: '0,0,-3' was given; a temperature must be >= 0 K"),
        ("t.csv", "x,y,temperature\n", "has no line below the header"),
        (
            "m.toml",
            "[material.40H]\nyoung = 1\npoisson = 0\n",
            "m.toml has no such material; did you mean '40H'?",
        ),
        (
            "m.toml",
            "[material.40Kh]\nyoung = -1\npoisson = 0\n",
            "m.toml:2: material.40Kh.young: -1 was given; must be > 0",
        ),
        ("m.toml", "[material.40Kh]\nyoung = \n", "m.toml:2: not valid TOML"),
    ] {
        let old = std::fs::read_to_string(at(file)).unwrap();
        std::fs::write(at(file), text).unwrap();
        let error = case::read(directory.path(), None, &[]).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
        std::fs::write(at(file), old).unwrap();
    }
}

#[test]
fn values_arrive() {
    let text = GOOD.replace("temperature = 393", "temperature = \"max(600 - 16000*x, 200)\"").replace(
        "[[contact]]",
        "[alternation]\ndriver = \"relaxed\"\nweights = \"response per surface\"\ntolerance = 1e-6\n[[contact]]",
    );
    let case = read_text(&text, None, &[]).unwrap();
    let Some(Temperature::Field(field)) = &case.bodies[0].temperature else { panic!("field") };
    assert_eq!((field.at(&[0.0, 0.0, 0.0]), field.at(&[0.03, 0.0, 0.0])), (600.0, 200.0));
    assert_eq!(case.alternation.driver, Driver::Relaxed(Weights::ResponseSurface));
    assert_eq!(
        (case.alternation.tolerance, case.alternation.max_alternations),
        (Tolerance::Fixed(1e-6), 200)
    );
    let LoadKind::Pressure(Region::Surface { name, within: None }, Scalar::Constant(p)) =
        &case.bodies[1].loads[0].kind
    else {
        panic!("pressure")
    };
    assert_eq!((name.as_str(), *p), ("top", 1e8));
    assert_eq!(
        (case.contacts[0].surfaces[0].body, case.contacts[0].surfaces[0].surface.as_str()),
        (BodyRef::Deformable(1), "bottom")
    );
    assert_eq!(case.name, "f");
}

#[test]
fn every_shipped_case_reads_with_every_variant() {
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases");
    let mut read = 0;
    for entry in std::fs::read_dir(cases).unwrap() {
        let path = entry.unwrap().path();
        if path.join("case.toml").is_file() {
            let variants = case::variant_names(&path).unwrap();
            for variant in std::iter::once(None).chain(variants.iter().map(|v| Some(v.as_str()))) {
                case::read(&path, variant, &[]).unwrap_or_else(|error| panic!("{variant:?}: {error}"));
                read += 1;
            }
        }
    }
    assert!(read > 20, "{read}");
}

#[test]
fn a_turned_case_and_one_in_other_units_are_the_same_case() {
    let text = GOOD
        .replace("temperature = 393", "temperature = \"300 + 1000*x\"")
        .replace("pressure = \"100 MPa\"", "traction = [3, 4]");
    let case = read_text(&text, None, &[]).unwrap();
    let turned = case.rotated(std::f64::consts::FRAC_PI_2).unwrap();
    let Some(Temperature::Field(field)) = &turned.bodies[0].temperature else { panic!("field") };
    // What was at (0.02, 0) is at (0, 0.02).
    assert!((field.at(&[0.0, 0.02, 0.0]) - 320.0).abs() < 1e-12);
    let LoadKind::Traction(_, [Scalar::Constant(x), Scalar::Constant(y), _]) =
        &turned.bodies[1].loads[0].kind
    else {
        panic!("traction")
    };
    assert!((x + 4.0).abs() < 1e-15 && (y - 3.0).abs() < 1e-15);
    assert!((turned.probes[0].at[0] + 0.02).abs() < 1e-17);

    let in_mm = case.rescaled(1e3, 1e-6);
    assert_eq!(in_mm.bodies[0].material.young, Property::Constant(2e5));
    assert_eq!((in_mm.analysis.thickness(), in_mm.contacts[0].gap.clone()), (1e3, Gap::Value(5e-5 * 1e3)));
    let Some(Temperature::Field(field)) = &in_mm.bodies[0].temperature else { panic!("field") };
    assert!((field.at(&[20.0, 0.0, 0.0]) - 320.0).abs() < 1e-12);

    let boxed = text.replace("surface = \"top\"\n", "surface = \"top\"\nwithin = { x = [0, 1] }\n");
    assert!(read_text(&boxed, None, &[]).unwrap().rotated(1.0).is_err());
}

/// A case with everything that a position can be in.
fn placed() -> Case {
    let more = "\n[[body]]\nname = \"r\"\nrigid.circle = { center = [0.02, 0.1], radius = 0.01, inside = true }\n\
                [[body]]\nname = \"s\"\nrigid.polyline = { points = [[0, -1], [1, -1]] }\nrigid.x = 1e-3\n\
                [[contact]]\nsurfaces = [\"s.surface\", \"upper.top\"]\nwithin = { x = [0, 1] }\n\
                [output]\nwindow = [[0, 0], [1, 1]]\n[[step]]\nloads = 0.5\n";
    let text = GOOD.replace("temperature = 393", "temperature = \"300 + 1000*x\"").replace(
        "surface = \"top\"\npressure = \"100 MPa\"",
        "surface = \"top\"\nwithin = { y = [0, 1] }\ntraction = [\"y\", 4]",
    );
    read_text(
        &(text.replacen("\n[[variant]]", &format!("{}\n[[variant]]", ANVIL.replace("\n[[variant]]", "")), 1)
            + more),
        None,
        &[],
    )
    .unwrap()
}

#[test]
fn a_moved_case_is_the_same_case() {
    let case = placed();
    let moved = case.translated(3.0, -2.0).unwrap();
    let Some(Temperature::Field(field)) = &moved.bodies[0].temperature else { panic!("field") };
    assert!((field.at(&[3.02, 7.0, 0.0]) - 320.0).abs() < 1e-11);
    let LoadKind::Traction(Region::Surface { within: Some(within), .. }, [x, ..]) =
        &moved.bodies[1].loads[0].kind
    else {
        panic!("traction")
    };
    assert!((x.at(&[0.0, -1.95, 0.0]) - 0.05).abs() < 1e-15);
    assert_eq!([within[0][0], within[0][1], within[1][1]], [f64::NEG_INFINITY, -2.0, -1.0]);
    let within = moved.contacts[2].surfaces[1].within.unwrap();
    assert_eq!([within[0][0], within[1][0], within[1][1]], [3.0, 4.0, f64::INFINITY]);
    let case::Geometry::Generated { translate, .. } = moved.bodies[1].geometry else { panic!("generated") };
    assert_eq!((translate, moved.probes[0].at), ([3.0, -2.0], [3.0, -1.98, 0.0]));
    assert_eq!(moved.output.window, Some([[3.0, -2.0], [4.0, -1.0]]));
    let shapes: Vec<&RigidShape> = moved.rigid.iter().map(|r| &r.shape).collect();
    let normal = [0.0, 1.0, 0.0];
    assert_eq!(shapes[0], &RigidShape::Plane { through: [3.0, -2.01, 0.0], normal });
    assert_eq!(shapes[1], &RigidShape::Circle { center: [3.02, -1.9, 0.0], radius: 0.01, inside: true });
    assert_eq!(shapes[2], &RigidShape::Polyline { points: vec![[3.0, -3.0, 0.0], [4.0, -3.0, 0.0]] });
    assert_eq!((moved.rigid[0].motion, moved.steps), (case.rigid[0].motion, case.steps));
}

#[test]
fn rigid_bodies_turn_and_scale_with_the_case() {
    let near = |a: [f64; 3], b: [f64; 3]| {
        assert!(std::iter::zip(a, b).all(|(a, b)| (a - b).abs() < 1e-15), "{a:?} {b:?}")
    };
    let case = read_text(&GOOD.replacen("[[variant]]", ANVIL, 1), None, &[]).unwrap();
    let turned = case.rotated(std::f64::consts::FRAC_PI_2).unwrap();
    near(turned.rigid[0].motion, [-1e-3, 0.0, 0.0]);
    let RigidShape::Plane { through, normal } = turned.rigid[0].shape else { panic!("plane") };
    near(through, [0.01, 0.0, 0.0]);
    near(normal, [-1.0, 0.0, 0.0]);
    let case = placed().rescaled(1e3, 1e-6);
    assert_eq!((case.rigid[0].motion, case.rigid[2].motion), ([0.0, 1.0, 0.0], [1.0, 0.0, 0.0]));
    let normal = [0.0, 1.0, 0.0];
    assert_eq!(case.rigid[0].shape, RigidShape::Plane { through: [0.0, -10.0, 0.0], normal });
    assert_eq!(
        case.rigid[1].shape,
        RigidShape::Circle { center: [20.0, 100.0, 0.0], radius: 10.0, inside: true }
    );
    assert_eq!(
        case.rigid[2].shape,
        RigidShape::Polyline { points: vec![[0.0, -1e3, 0.0], [1e3, -1e3, 0.0]] }
    );
}

#[test]
fn a_swapped_case_names_the_same_things() {
    let case = placed();
    let swapped = case.swapped();
    let pairs = |case: &Case| -> Vec<[String; 2]> {
        let name = |s: &case::SurfaceName| format!("{}.{}", case.body_name(s.body), s.surface);
        case.contacts.iter().map(|c| [name(&c.surfaces[0]), name(&c.surfaces[1])]).collect()
    };
    let reversed: Vec<[String; 2]> = pairs(&case).into_iter().map(|[a, b]| [b, a]).collect();
    assert_eq!(pairs(&swapped), reversed);
    assert_eq!(pairs(&swapped)[2], ["upper.top", "s.surface"]);
    assert_eq!((swapped.bodies[0].name.as_str(), swapped.rigid[0].name.as_str()), ("upper", "s"));
    assert_eq!(swapped.bodies[swapped.probes[0].body].name, "upper");
    assert_eq!(pairs(&swapped.swapped()), pairs(&case));
}

/// Every character of the good case, replaced or left out: an answer or a message, never a panic, never "internal".
/// A case may come from anybody: what writes files is refused by name, whatever it hides in.
#[test]
fn options_that_act_are_refused() {
    let with = |options: &str| {
        let text = GOOD.replacen("name = \"upper\"", &format!("name = \"upper\"\nsolver = {options}"), 1);
        read_text(&text, None, &[])
    };
    let case = with("\"-ksp_type cg -pc_type gamg -ksp_rtol 1e-10\"").unwrap();
    assert_eq!(case.bodies[1].solver.as_deref(), Some("-ksp_type cg -pc_type gamg -ksp_rtol 1e-10"));
    for (options, named) in [
        ("\"-ksp_view ascii:/tmp/x\"", "-ksp_view"),
        ("\"-ksp_type cg -ksp_view_mat binary:x\"", "-ksp_view_mat"),
        ("\"-ksp_monitor :x\"", "-ksp_monitor"),
        ("\"-ksp_type cg\\t-options_file x\"", "-options_file"),
        ("\"\"\"-pc_type gamg\n-log_view :x\"\"\"", "-log_view"),
        ("\"\"", "PETSc options begin with '-'"),
        ("\"cg\"", "'cg' belongs to no option"),
    ] {
        let error = with(options).unwrap_err();
        assert!(
            error.starts_with("f.toml:21: body.upper.solver: ") && error.contains(named),
            "{options}: {error}"
        );
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    let set = "body.upper.solver=-mat_view binary:x";
    assert!(read_text(GOOD, None, &[set]).unwrap_err().contains("-mat_view"));
    let study = format!("{GOOD}[study]\nsolvers = [\"-ksp_type cg\", \"-pc_view :x\"]\n");
    assert!(read_text(&study, None, &[]).unwrap_err().contains("study.solvers.1"));
}

/// What would act on a terminal or break a picture is refused, and shown as text where it is quoted.
#[test]
fn texts_are_plain_and_not_too_long() {
    let long = "x".repeat(100_000);
    for (line, expected) in [
        (
            "title = \"a\\u001b[2J\"".to_string(),
            "title: \"a\\u001B[2J\" was given; control characters (here \\u{1b})",
        ),
        ("title = \"a\\u202Eb\"".into(), "control characters (here \\u{202e}) are not allowed"),
        ("title = \"a\\nb\"".into(), "on one line"),
        (format!("title = \"{long}\""), "it is longer than 10000 bytes"),
        (format!("title = \"{}\"", "ä".repeat(201)), "at most 200 characters"),
        (format!("\"{long}\" = 1"), "unknown key"),
        (format!("units = \"{long}\""), "units: "),
    ] {
        let error = read_text(&format!("{line}\n{GOOD}"), None, &[]).unwrap_err();
        assert!(error.starts_with("f.toml:1: ") && error.contains(expected), "{error}");
        assert!(error.len() < 2_000 && error.lines().count() == 1, "{} bytes", error.len());
    }
    check(&[
        ("name = \"A\"", "name = \"A\\u0007\"", "control characters (here \\u{7})"),
        ("surface = \"bottom\"", "surface = \"bot\\u001btom\"", "control characters"),
        ("\"lower.top\"]", "\"lower.to\\u0000p\"]", "control characters"),
    ]);
    let name = GOOD.replace("\"main\"", &format!("\"{}\"", "m".repeat(101)));
    assert!(read_text(&name, None, &[]).unwrap_err().contains("at most 100 characters"));
    assert!(read_text(&format!("title = \"Prüfling <1> & 接触\"\n{GOOD}"), None, &[]).is_ok());
}

/// Whatever is too large is refused with its number.
#[test]
fn a_million_cells_are_read_and_more_are_refused() {
    let cells = |n: &str| read_text(&GOOD.replacen("cells = 4 }", &format!("cells = {n} }}"), 1), None, &[]);
    assert!(cells("1000000").is_ok());
    assert!(cells("1000001").unwrap_err().contains("an integer from 1 to 1000000 is needed"));
    for shape in [
        "ring = { radius = { from = 1, to = 2, cells = 1 }, angle = { from = 0, to = 90, cells = 1000000 } }",
        "disc = { radius = 1, quarter = 1000000, depth = { to = 0.5, cells = 1 } }",
    ] {
        let text = format!("{}\nmesh.refine = 1\nmesh.{shape}\n", body_without_mesh());
        let error = read_text(&text, None, &[]).unwrap_err();
        assert!(error.contains("refine") && error.contains("this makes 2000000 cells"), "{error}");
        assert!(read_text(&text.replace("mesh.refine = 1\n", ""), None, &[]).is_ok());
    }
}

fn body_without_mesh() -> &'static str {
    "analysis = \"plane stress\"\n[[body]]\nname = \"b\"\nmaterial = { young = 1, poisson = 0 }"
}

/// Work that grows with the square of the length would take minutes here, and fail the limit of every test run.
#[test]
fn a_table_of_two_hundred_thousand_rows_is_read_at_once() {
    let column = |of: fn(usize) -> usize| {
        let cells: Vec<String> = (0..200_000).map(|i| of(i).to_string()).collect();
        format!("[\n{}\n]", cells.join(",\n"))
    };
    let table =
        format!("young = {{ temperature = {}, value = {} }}", column(|i| 1 + i), column(|i| 1000 + i));
    let lines = table.lines().count();
    let case = read_text(&GOOD.replace("young = \"200 GPa\"", &table), None, &["body.upper.temperature=300"]);
    let Property::Table(rows) = &case.unwrap().bodies[0].material.young else { panic!("a table") };
    assert_eq!((rows.len(), rows[199_999]), (200_000, (200_000.0, 200_999.0)));
    // Places are still right behind it.
    let wrong = GOOD.replace("young = \"200 GPa\"", &table).replace("poisson = 0.3", "poisson = 0.7");
    let error = read_text(&wrong, None, &["body.upper.temperature=300"]).unwrap_err();
    assert!(error.starts_with(&format!("f.toml:{}: ", 4 + lines)), "{error}");
}

#[test]
fn no_slip_of_the_pen_is_a_panic() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("f.toml");
    let (mut good, mut bad) = (0, 0);
    for (i, c) in GOOD.char_indices() {
        for new in ["", "9", ".", "-", "é", "\"", "[", "\n"] {
            let text = format!("{}{new}{}", &GOOD[..i], &GOOD[i + c.len_utf8()..]);
            std::fs::write(&file, text).unwrap();
            match case::read(&file, None, &[]) {
                Ok(_) => good += 1,
                Err(Error::Input(text)) => {
                    assert!(!text.contains("internal") && !text.is_empty(), "{text}");
                    bad += 1;
                }
                Err(error) => panic!("{error:?}"),
            }
        }
    }
    assert!(good > 100 && bad > 1000, "{good} {bad}");
}
