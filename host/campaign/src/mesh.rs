//! Meshes of a scenario: the files that its solids name, checked and prepared, and what `check` states of them.

use crate::check::{Checker, span_of};
use crate::mobility::effective_mass;
use crate::overlap::millimetres;
use crate::source::Source;
use crate::written::At;
use crate::written::scenario::SolidTable;
use softdock_input::InputError;
use softdock_kernels::contact::mesh::Mesh;
use softdock_kernels::model::{Model, PartShape, Shape};
use softdock_kernels::plant::part_points;
use softdock_kernels::range::{LENGTH, Range};
use softdock_mesh::{DEFAULT_POINTS, Fault, Format, MOST_POINTS, Options, Report, Solid, Triangles};
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
    /// Key of its solid: `part_a.solid[1]`.
    key: String,
    path: PathBuf,
    bytes: Arc<[u8]>,
    report: Report,
}

impl MeshFile {
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The key that names it.
    pub(crate) fn file_key(&self) -> String {
        format!("{}.file", self.key)
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
type Known = Mutex<HashMap<String, (Weak<Mesh>, Report)>>;

fn known() -> &'static Known {
    static KNOWN: OnceLock<Known> = OnceLock::new();
    KNOWN.get_or_init(Known::default)
}

/// Puts the meshes in the places of their solids; `tables` are those of the solids of parts A and B.
pub(crate) fn read(c: &mut Checker, tables: [&[SolidTable]; 2], parts: [&mut PartShape; 2]) -> Vec<MeshFile> {
    let margins = parts.each_ref().map(|part| {
        part_points(part).iter().map(|(_, feature)| feature.point.radius).fold(0.0, f64::max)
    });
    let mut files = Vec::new();
    for (side, part) in parts.into_iter().enumerate() {
        for (index, table) in tables[side].iter().enumerate().filter(|(_, table)| table.shape.value == "mesh") {
            let key = format!("part_{}.solid[{}]", ["a", "b"][side], index + 1);
            if let Some((shape, file)) = one(c, table, key, margins[1 - side]) {
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
fn one(c: &mut Checker, table: &SolidTable, key: String, margin: f64) -> Option<(Shape, MeshFile)> {
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
    let density =
        table.density.as_ref().map(|written| c.number(written, "kg/m^3", Range::within(1.0, 3e4)));
    let options = Options { resolution, margin, points, patch: patch.unwrap_or(1.0) };
    let (path, bytes) = bytes(c, file)?;
    let Some(format) = Format::of(&file.value) else {
        let shown = path.display();
        c.refuse(&file.span, format!("`{shown}` is no mesh file by its name"), "name a file that ends in .stl or .obj");
        return None;
    };
    match prepared(&bytes, format, unit, &options, density) {
        Ok((mesh, report)) => {
            let size = report.size.norm();
            if !SIZES.contains(size) {
                let message = format!("the mesh is {} long: {}", millimetres(size), in_unit(table));
                c.refuse(&file.span, message, "correct `unit`, or scale the mesh");
                return None;
            }
            Some((Shape::Mesh(mesh), MeshFile { key, path, bytes, report }))
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

/// Reads, checks and prepares a mesh, or takes the same one from before.
fn prepared(
    bytes: &[u8],
    format: Format,
    unit: f64,
    options: &Options,
    density: Option<f64>,
) -> Result<(Arc<Mesh>, Report), Fault> {
    let what = format!("{} {format:?} {unit} {options:?} {density:?}", blake3::hash(bytes).to_hex());
    if let Some((mesh, report)) = known().lock().expect("no holder panics").get(&what)
        && let Some(mesh) = mesh.upgrade()
    {
        return Ok((mesh, *report));
    }
    let solid = Solid::check(&Triangles::read(bytes, format, unit)?)?;
    let mesh = Arc::new(softdock_mesh::prepare(&solid, options)?);
    let report = softdock_mesh::report(&solid, &mesh, density);
    known().lock().expect("no holder panics").insert(what, (Arc::downgrade(&mesh), report));
    Ok((mesh, report))
}

/// Refuses a mesh far larger or smaller than what it meets: its unit is most likely another one.
pub(crate) fn refuse_sizes(c: &mut Checker, tables: [&[SolidTable]; 2], parts: [&PartShape; 2]) {
    for side in 0..2 {
        let reach = |part: &PartShape| {
            let points = part_points(part).into_iter().map(|(_, feature)| feature.point.position.norm() + feature.point.radius);
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
                let remedy = format!("correct `unit` or the sizes of the other part: {MOST_RATIO} times as large at most");
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
            format!("{}: mesh of {} triangles, {x} x {y} x {z}, {:.4e} m^3", file.key, r.triangles, r.volume),
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
            let (centre, i) = (mass.centre.map(|length| length * 1e3), mass.inertia);
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
