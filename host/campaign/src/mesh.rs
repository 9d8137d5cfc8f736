//! Meshes of a scenario: the files that its solids name, checked and prepared, and what `check` states of them.

use crate::check::{Checker, span_of};
use crate::inertia::Joined;
use crate::mobility::effective_mass;
use crate::overlap::millimetres;
use crate::source::Source;
use crate::written::At;
use crate::written::scenario::SolidTable;
use softdock_input::InputError;
use softdock_kernels::contact::mesh::Mesh;
use softdock_kernels::model::{Model, PartShape, Shape, Side};
use softdock_kernels::plant::part_points;
use softdock_kernels::range::{LENGTH, Range};
use softdock_kernels::vector::{Pose, Quat};
use softdock_mesh::{
    ClosedMesh, DEFAULT_POINTS, Format, MOST_POINTS, MassProperties, MeshFault, MeshReport, Options, Triangles,
};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, Weak};

/// Largest mesh file: a binary STL with the most triangles has 25 MB, the same as text up to 140.
const LARGEST: u64 = 160 << 20;

/// Least and greatest size of a mesh, and so many times as large as the other part at most \[m\].
const SIZES: Range = Range::within(1e-4, 100.0);
const MOST_RATIO: f64 = 100.0;

/// Largest binding of WebGPU's default limits: the tables of all meshes \[bytes\].
const MOST_BYTES: usize = 128 << 20;

/// Error of a grid over the depth of a nominal touch at which the suggested resolution aims.
const ERROR: f64 = 0.01;

/// A mesh file of a scenario.
#[derive(Clone, Debug)]
pub(crate) struct MeshFile {
    /// Part and place of its solid there.
    side: Side,
    solid: usize,
    path: PathBuf,
    bytes: Arc<[u8]>,
    report: MeshReport,
}

impl MeshFile {
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Key of its solid: `part_a.solid[1]`.
    fn key(&self) -> String {
        let part = match self.side {
            Side::A => "part_a",
            Side::B => "part_b",
        };
        format!("{part}.solid[{}]", self.solid + 1)
    }

    /// The key that names it.
    pub(crate) fn file_key(&self) -> String {
        format!("{}.file", self.key())
    }

    /// Hash of its bytes.
    pub(crate) fn hash(&self) -> String {
        blake3::hash(&self.bytes).to_hex().to_string()
    }

    /// Its contents as text with the same triangles: a binary STL becomes an ASCII one.
    pub(crate) fn text(&self) -> String {
        match std::str::from_utf8(&self.bytes) {
            Ok(text) => text.to_owned(),
            Err(_) => softdock_mesh::ascii_stl(&self.bytes).expect("it was read before"),
        }
    }
}

/// Prepared meshes by the hash of file and options: variants of a campaign share them.
type Known = Mutex<HashMap<String, (Weak<Mesh>, MeshReport)>>;

fn known() -> &'static Known {
    static KNOWN: OnceLock<Known> = OnceLock::new();
    KNOWN.get_or_init(Known::default)
}

/// Puts the meshes in the places of their solids; `tables` are those of the solids of parts A and B.
pub(crate) fn read(c: &mut Checker, tables: [&[SolidTable]; 2], parts: [&mut PartShape; 2]) -> Vec<MeshFile> {
    let margins = parts
        .each_ref()
        .map(|part| part_points(part).iter().map(|(_, feature)| feature.point.radius).fold(0.0, f64::max));
    let mut files = Vec::new();
    for (side, part) in parts.into_iter().enumerate() {
        for (index, table) in tables[side].iter().enumerate().filter(|(_, table)| table.shape.value == "mesh") {
            let place = (Side::BOTH[side], index);
            if let Some((shape, file)) = one(c, table, place, margins[1 - side]) {
                part.solids[index].shape = shape;
                files.push(file);
            }
        }
    }
    let bytes: usize = files.iter().map(|file| file.report.bytes).sum();
    if let (true, Some(last)) = (bytes > MOST_BYTES, files.last()) {
        let span = c.source.span_of(&last.file_key());
        let message = format!("the grids of all meshes have {} MiB", bytes >> 20);
        c.refuse(&span, message, format!("write coarser resolutions: {} MiB at most", MOST_BYTES >> 20));
    }
    files
}

/// A mesh with the file that it came from; `None` after a problem.
fn one(c: &mut Checker, table: &SolidTable, place: (Side, usize), margin: f64) -> Option<(Shape, MeshFile)> {
    let (file, unit) = (table.file.as_ref()?, table.unit.as_ref()?);
    let unit = c.choice(unit, &[("mm", 1e-3), ("cm", 1e-2), ("m", 1.0), ("in", 0.0254)]);
    let length = Range::above(0.0, LENGTH);
    let resolution = table.resolution.as_ref().map(|written| c.number(written, "m", length));
    let patch = table.patch.as_ref().map(|written| c.number(written, "m^2", Range::above(0.0, 100.0)));
    let points = match (&table.points, patch) {
        (Some(written), None) => {
            let remedy = "add patch = \"100 mm^2\": the area whose points together have the pair's stiffness";
            c.refuse(&written.span, "contact points of a mesh need the area of their stiffness", remedy);
            0
        }
        (Some(written), Some(_)) => c.count(written, 20, MOST_POINTS as u64) as usize,
        (None, Some(_)) => DEFAULT_POINTS,
        (None, None) => 0,
    };
    let density = table.density.as_ref().map(|written| c.number(written, "kg/m^3", Range::within(1.0, 3e4)));
    let options = Options { resolution, margin, points, patch: patch.unwrap_or(1.0) };
    let (path, bytes) = bytes(c, file)?;
    let Some(format) = Format::of(&file.value) else {
        let shown = path.display();
        c.refuse(&file.span, format!("`{shown}` is no mesh file by its name"), "name a file that ends in .stl or .obj");
        return None;
    };
    match prepared(&bytes, format, unit, &options, density) {
        Ok((mesh, report)) => {
            Some((Shape::Mesh(mesh), MeshFile { side: place.0, solid: place.1, path, bytes, report }))
        }
        Err(fault) => {
            c.refuse(&file.span, format!("`{}`: {}", path.display(), fault.message), fault.remedy);
            None
        }
    }
}

fn in_unit(table: &SolidTable) -> String {
    table.unit.as_ref().map_or_else(String::new, |unit| format!("is its unit of length \"{}\"?", unit.value))
}

/// A file of bytes beside the one that names it.
fn bytes(c: &mut Checker, file: &At<String>) -> Option<(PathBuf, Arc<[u8]>)> {
    // A variant's file is seen from the campaign that names it.
    let (source, _): (Source, _) = c.source.resolve(file.span.clone());
    let path = source.sibling(&file.value);
    match softdock_input::read(&path, LARGEST) {
        Ok(bytes) => Some((path, bytes.into())),
        Err(InputError::Absent { .. }) => {
            let remedy = "check the path; it is relative to the file that names it";
            c.refuse(&file.span, format!("there is no file `{}`", path.display()), remedy);
            None
        }
        Err(error) => {
            c.refuse(&file.span, format!("`{}` {}", path.display(), error.what()), error.remedy());
            None
        }
    }
}

/// Mass properties of the meshes of a part that state a density, in the part's frame; `None` where none does. A mesh that is
/// refused has no mass.
pub(crate) fn mass_of(files: &[MeshFile], side: Side, tables: &[SolidTable], part: &PartShape) -> Option<Joined> {
    if !tables.iter().any(|table| table.shape.value == "mesh" && table.density.is_some()) {
        return None;
    }
    let mut all = Joined::nothing();
    for file in files.iter().filter(|file| file.side == side) {
        if let Some(MassProperties { mass, centre, inertia }) = file.report.mass {
            let centre = Pose { position: centre, attitude: Quat::identity() };
            all.add(mass, inertia, part.solids[file.solid].frame.compose(centre));
        }
    }
    Some(all)
}

/// Reads, checks and prepares a mesh, or takes the same one from before.
fn prepared(
    bytes: &[u8],
    format: Format,
    unit: f64,
    options: &Options,
    density: Option<f64>,
) -> Result<(Arc<Mesh>, MeshReport), MeshFault> {
    let what = format!("{} {format:?} {unit} {options:?} {density:?}", blake3::hash(bytes).to_hex());
    if let Some((mesh, report)) = known().lock().expect("no holder panics").get(&what)
        && let Some(mesh) = mesh.upgrade()
    {
        return Ok((mesh, *report));
    }
    let solid = ClosedMesh::check(&Triangles::read(bytes, format, unit)?)?;
    // Before its grid, which would have far too many or too few nodes.
    let [low, high] = solid.bounds();
    let size = (high - low).norm();
    if !SIZES.contains(size) {
        let message = format!("the mesh is {} long: is its unit of length {} m?", millimetres(size), unit);
        return Err(MeshFault { message, remedy: "correct `unit`, or scale the mesh".to_owned() });
    }
    let mesh = Arc::new(softdock_mesh::prepare(&solid, options)?);
    let report = softdock_mesh::report(&solid, &mesh, density);
    known().lock().expect("no holder panics").insert(what, (Arc::downgrade(&mesh), report));
    Ok((mesh, report))
}

/// Refuses a mesh far larger or smaller than what it meets: its unit is most likely another one.
pub(crate) fn refuse_sizes(c: &mut Checker, tables: [&[SolidTable]; 2], parts: [&PartShape; 2]) {
    for side in 0..2 {
        let reach = |part: &PartShape| {
            let points =
                part_points(part).into_iter().map(|(_, feature)| feature.point.position.norm() + feature.point.radius);
            points.chain(part.solids.iter().map(|solid| solid.shape.reach())).fold(0.0, f64::max)
        };
        let other = reach(parts[1 - side]);
        for (table, solid) in tables[side].iter().zip(&parts[side].solids) {
            let (Shape::Mesh(mesh), Some(file)) = (&solid.shape, &table.file) else { continue };
            let (own, ratio) = (mesh.ball.radius, mesh.ball.radius / other);
            // A plane has no size.
            if other > 0.0 && !(1.0 / MOST_RATIO..=MOST_RATIO).contains(&ratio) {
                let message = format!(
                    "the mesh reaches {} from its middle, the other part {}: {}",
                    millimetres(own),
                    millimetres(other),
                    in_unit(table)
                );
                let remedy =
                    format!("correct `unit` or the sizes of the other part: {MOST_RATIO} times as large at most");
                c.refuse(&file.span, message, remedy);
            }
        }
    }
}

/// Refuses what a shell cannot do.
pub(crate) fn refuse_bilateral(c: &mut Checker, tables: [&[SolidTable]; 2], is_bilateral: bool) {
    for patch in tables.into_iter().flatten().filter_map(|table| span_of(&table.patch)).filter(|_| is_bilateral) {
        let remedy = "remove `patch`, or write bilateral = false";
        c.refuse(&patch, "a bilateral contact never opens: a shell would pull with its whole surface", remedy);
    }
}

/// Lines of `check`: what each mesh is, what its grid needs, and how accurate it is.
pub(crate) fn lines(files: &[MeshFile], model: &Model) -> Vec<String> {
    // Depth of the undamped linear contact at the closing speed.
    let mass = effective_mass(model, model.nominal.base_mass, model.nominal.target_mass);
    let depth = mass.map(|mass| model.nominal.closing_speed * (mass / model.nominal.contact_stiffness).sqrt());
    let depth = depth.filter(|depth| depth.is_finite() && *depth > 0.0).unwrap_or(model.task.max_depth);
    let of = |file: &MeshFile| {
        let r = &file.report;
        let [x, y, z] = [r.size.x, r.size.y, r.size.z].map(millimetres);
        let mut lines = vec![
            format!("{}: mesh of {} triangles, {x} x {y} x {z}, {:.4e} m^3", file.key(), r.triangles, r.volume),
            format!(
                "  grid of {} cells of {}, {:.1} MiB with {} contact points; error {} on faces, {} at sharp edges",
                r.cells,
                millimetres(r.cell),
                r.bytes as f64 / f64::from(1 << 20),
                r.points,
                micrometres(r.error_of_faces),
                micrometres(r.error_of_edges)
            ),
        ];
        let aim = ERROR * depth;
        if r.error_of_faces > aim {
            lines.push(format!(
                "  note: the error on faces is {:.1} % of the depth {} of a nominal touch; for {} % write resolution = \"{}\"",
                100.0 * r.error_of_faces / depth,
                millimetres(depth),
                100.0 * ERROR,
                millimetres(r.resolution_for(aim))
            ));
        }
        lines.extend(r.mass.map(|mass| {
            // Rounding of products that vanish by symmetry.
            let least = 1e-12 * mass.inertia.xx.max(mass.inertia.yy);
            let i = mass.inertia.map(|product| if product.abs() < least { 0.0 } else { product });
            let centre = mass.centre.map(|length| length * 1e3);
            format!(
                "  mass {:.4e} kg, centre ({:.3}, {:.3}, {:.3}) mm, inertia about it xx {:.4e} yy {:.4e} zz {:.4e} xy {:.4e} xz {:.4e} yz {:.4e} kg m^2",
                mass.mass, centre.x, centre.y, centre.z, i.xx, i.yy, i.zz, i.xy, i.xz, i.yz
            )
        }));
        lines
    };
    files.iter().flat_map(of).collect()
}

/// A length in micrometres.
fn micrometres(length: f64) -> String {
    format!("{:.3} um", length * 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::Problems;
    use crate::scenario::Scenario;
    use crate::scenario::tests::FREE_BODY;
    use softdock_kernels::vector::vec3;

    /// A cube of 200 about the origin, its triangles counter-clockwise from outside.
    const CUBE: &str = "v -100 -100 -100\nv 100 -100 -100\nv -100 100 -100\nv 100 100 -100\nv -100 -100 100\n\
                        v 100 -100 100\nv -100 100 100\nv 100 100 100\nf 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\n\
                        f 1 3 4 2\nf 5 6 8 7\n";

    const PLANE: &str = "shape = \"plane\"";

    const SOLID: &str = "shape = \"mesh\"\nfile = \"cube.obj\"\nunit = \"mm\"\nresolution = \"10 mm\"\n\
                         position = [\"100 mm\", \"0 mm\", \"0 mm\"]\n";

    fn loaded(obj: &str, solid: &str) -> Result<Scenario, Problems> {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("cube.obj"), obj).expect("written");
        let text = FREE_BODY.replace(PLANE, solid);
        Scenario::from_source(Source::new(folder.path().join("test.toml"), text))
    }

    #[test]
    fn mesh_is_read_beside_its_scenario_and_reported() {
        let found = loaded(CUBE, &format!("{SOLID}density = \"2.7 g/cm^3\"\n")).expect("valid");
        let Shape::Mesh(mesh) = &found.model.contact.b.solids[0].shape else { panic!("no mesh") };
        assert_eq!((mesh.triangles.len(), mesh.shell.len()), (12, 0));
        // The ball of part A has a radius of 100 mm.
        assert!(mesh.grid.margin >= 0.1, "{}", mesh.grid.margin);
        let lines = found.mesh_lines().join("\n");
        for part in ["12 triangles", "200 mm x 200 mm x 200 mm", "8.0000e-3 m^3", "MiB", "mass 2.1600e1 kg"] {
            assert!(lines.contains(part), "{part}: {lines}");
        }
        let other = loaded(&CUBE.replace("100", "101"), SOLID).expect("valid");
        assert_ne!(found.mesh_hashes(), other.mesh_hashes());
    }

    const MASSES: [&str; 2] = [
        "[target]\nmass = \"400 kg\"\ninertia = { ixx = \"60 kg m^2\", iyy = \"60 kg m^2\", izz = \"60 kg m^2\" }\n",
        "[target]\n",
    ];

    /// A cube of 21.6 kg on the axis: a sixth of m a^2 about its centre. The target's frame is there, turned as the part asks.
    #[test]
    fn target_without_a_mass_has_that_of_its_meshes() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("cube.obj"), CUBE).expect("written");
        let solid = format!("{SOLID}density = \"2.7 g/cm^3\"\n");
        let read = |part: &str, solid: &str| {
            let text = FREE_BODY.replace(PLANE, solid).replace(MASSES[0], MASSES[1]).replace("[part_b]\n", part);
            Scenario::from_source(Source::new(folder.path().join("test.toml"), text))
        };
        let model = read("[part_b]\nrotation = [\"0 deg\", \"0 deg\", \"90 deg\"]\n", &solid).expect("valid").model;
        let moment = 21.6 * 0.04 / 6.0;
        assert!((model.nominal.target_mass - 21.6).abs() < 1e-9, "{}", model.nominal.target_mass);
        let inertia = model.target_inertia;
        for (one, wanted) in [(inertia.xx, moment), (inertia.yy, moment), (inertia.zz, moment), (inertia.xy, 0.0)] {
            assert!((one - wanted).abs() < 1e-9, "{inertia:?}");
        }
        // The part's x axis, on which the cube's centre is at 100 mm, is the body's y axis.
        assert!((model.seat.position - vec3(0.0, -0.1, 0.0)).norm() < 1e-12, "{:?}", model.seat);
        let start = model.target_pose.compose(model.seat);
        assert!(start.position.norm() < 1e-12, "part B starts at the origin: {start:?}");
        let placed = "[part_b]\nposition = [\"0 m\", \"0 m\", \"0 m\"]\n";
        for (part, solid, message) in [
            (placed, &solid[..], "centre of mass follows from the meshes"),
            ("[part_b]\n", SOLID, "this key must be there"),
        ] {
            let problems = read(part, solid).map(|_| ()).expect_err(message);
            assert!(problems.to_string().contains(message), "{problems}");
        }
    }

    #[test]
    fn shell_has_the_stated_patch() {
        let solid = format!("{SOLID}patch = \"100 cm^2\"\npoints = 200\n");
        let found = loaded(CUBE, &solid).expect("valid");
        let Shape::Mesh(mesh) = &found.model.contact.b.solids[0].shape else { panic!("no mesh") };
        let share: f64 = mesh.shell.iter().map(|point| point.share).sum();
        assert!((share - 24.0).abs() < 1e-6, "0.24 m^2 in patches of 0.01 m^2: {share}");
    }

    #[test]
    fn bad_meshes_are_refused_at_the_key_with_a_remedy() {
        let hole = CUBE.replace("f 5 6 8 7\n", "");
        let inwards = CUBE.lines().map(|line| match line.strip_prefix("f ") {
            Some(face) => format!("f {}\n", face.split(' ').rev().collect::<Vec<_>>().join(" ")),
            None => format!("{line}\n"),
        });
        let flat = CUBE.replace(" -100\n", " -1e-8\n").replace(" 100\n", " 1e-8\n");
        let metres = SOLID.replace("\"mm\"", "\"m\"");
        let cases = [
            (hole, SOLID.to_owned(), "file", "has a hole", "close holes"),
            (inwards.collect(), SOLID.to_owned(), "file", "normals point inwards", "flip the orientation"),
            (flat, SOLID.to_owned(), "file", "volume", "thickness"),
            (CUBE.to_owned(), metres, "file", "is its unit of length 1 m?", "correct `unit`"),
            (CUBE.replace("100", "1e-2"), SOLID.to_owned(), "file", "unit of length", "correct `unit`"),
            (CUBE.to_owned(), SOLID.replace("cube.obj", "none.obj"), "file", "there is no file", "check the path"),
            (CUBE.to_owned(), SOLID.replace("cube.obj", "test.txt"), "file", "there is no file", "check the path"),
            (CUBE.to_owned(), SOLID.replace("unit = \"mm\"\n", ""), "shape", "needs the key `unit`", "add unit"),
            (CUBE.to_owned(), format!("{SOLID}points = 100\n"), "points", "area of their stiffness", "add patch"),
            (CUBE.to_owned(), SOLID.replace("10 mm", "0.1 mm"), "file", "nodes", "write a resolution of at least"),
            (CUBE.to_owned(), format!("{SOLID}radius = \"1 mm\"\n"), "radius", "does not take", "remove it"),
        ];
        for (obj, solid, key, message, remedy) in cases {
            let problems = loaded(&obj, &solid).map(|_| ()).expect_err(message);
            let problem = problems.iter().next().expect("never empty");
            assert_eq!(problem.key, format!("part_b.solid[1].{key}"), "{problems}");
            assert!(problem.message.contains(message) && problem.remedy.contains(remedy), "{problems}");
            assert!(problem.line > 18, "{problems}");
        }
    }

    #[test]
    fn far_smaller_part_than_the_mesh_is_refused() {
        // A cube of 20 m before a ball of 0.1 m.
        let problems =
            loaded(&CUBE.replace("100", "20000"), &SOLID.replace("10 mm", "1 m")).map(|_| ()).expect_err("large");
        assert!(problems.to_string().contains("the other part 100 mm"), "{problems}");
    }

    #[test]
    fn bilateral_contact_takes_no_shell() {
        let text = format!("{SOLID}patch = \"100 cm^2\"\n");
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("cube.obj"), CUBE).expect("written");
        let text = FREE_BODY.replace(PLANE, &text).replace("[start]", "bilateral = true\n[start]");
        let problems =
            Scenario::from_source(Source::new(folder.path().join("test.toml"), text)).map(|_| ()).expect_err("no");
        assert!(problems.to_string().contains("never opens"), "{problems}");
    }

    #[test]
    fn gathered_scenario_has_its_meshes_beside_it() {
        let found = loaded(CUBE, SOLID).expect("valid");
        let (text, beside) = found.gathered();
        assert_eq!(beside, [("cube.obj".to_owned(), CUBE.to_owned())]);
        assert!(text.contains("file = \"cube.obj\""), "{text}");
    }
}
