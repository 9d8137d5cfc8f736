//! Corners and triangles of a mesh file, in metres.

use crate::fault::MeshFault;
use softdock_kernels::vector::{Vec3, vec3};
use std::collections::HashMap;
use std::io::Cursor;

/// Most triangles of a mesh: a grid and a shell resolve no finer ones.
pub const MOST_TRIANGLES: usize = 500_000;

/// What to do about a file that no reader understands.
const EXPORT: &str = "export the part again, as binary STL or as OBJ with triangles";

/// Format of a mesh file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// STL, binary or ASCII.
    Stl,
    /// Wavefront OBJ; its groups together are one mesh.
    Obj,
}

impl Format {
    /// By the extension of a file's name.
    pub fn of(name: &str) -> Option<Self> {
        let (_, extension) = name.rsplit_once('.')?;
        match extension.to_ascii_lowercase().as_str() {
            "stl" => Some(Self::Stl),
            "obj" => Some(Self::Obj),
            _ => None,
        }
    }
}

/// Corners and triangles; equal corners are one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Triangles {
    /// Corners \[m\].
    pub vertices: Vec<Vec3<f64>>,
    /// Triangles by their corners.
    pub triangles: Vec<[u32; 3]>,
}

impl Triangles {
    /// Reads a file's bytes; `unit` is its unit of length \[m\].
    ///
    /// # Errors
    /// If the bytes are no file of this format, a number is not finite, or there are no or too many triangles.
    pub fn read(bytes: &[u8], format: Format, unit: f64) -> Result<Self, MeshFault> {
        let corners = match format {
            Format::Stl => stl(bytes),
            Format::Obj => obj(bytes),
        }?;
        if corners.is_empty() {
            return Err(MeshFault::new("the file has no triangles", EXPORT));
        }
        if corners.len() > MOST_TRIANGLES {
            let remedy = format!("simplify the mesh to at most {MOST_TRIANGLES} triangles");
            return Err(MeshFault::new(format!("the file has {} triangles", corners.len()), remedy));
        }
        if let Some(index) = corners.iter().position(|corners| corners.iter().flatten().any(|c| !c.is_finite())) {
            let message = format!("triangle {} has a corner that is not finite", index + 1);
            return Err(MeshFault::new(message, EXPORT));
        }
        Ok(Self::of(corners.into_iter().map(|corners| corners.map(|[x, y, z]| vec3(x, y, z) * unit))))
    }

    /// Joins equal corners.
    pub fn of(corners: impl Iterator<Item = [Vec3<f64>; 3]>) -> Self {
        let (mut out, mut known) = (Self::default(), HashMap::new());
        for corners in corners {
            let triangle = corners.map(|corner| {
                // Both zeros are one place.
                let key = [corner.x + 0.0, corner.y + 0.0, corner.z + 0.0].map(f64::to_bits);
                *known.entry(key).or_insert_with(|| {
                    out.vertices.push(corner);
                    (out.vertices.len() - 1) as u32
                })
            });
            // A triangle that has lost a corner to another has no area, and no neighbour misses it.
            let [a, b, c] = triangle;
            if a != b && b != c && c != a {
                out.triangles.push(triangle);
            }
        }
        out
    }
}

/// A binary STL as an ASCII one with the same triangles, to the bit.
///
/// # Errors
/// If the bytes are no STL file.
pub fn ascii_stl(bytes: &[u8]) -> Result<String, MeshFault> {
    let mut text = String::from("solid mesh\n");
    for corners in stl(bytes)? {
        text += "facet normal 0 0 0\nouter loop\n";
        for [x, y, z] in corners.map(|corner| corner.map(|number| number as f32)) {
            text += &format!("vertex {x:e} {y:e} {z:e}\n");
        }
        text += "endloop\nendfacet\n";
    }
    Ok(text + "endsolid mesh\n")
}

type Corners = Vec<[[f64; 3]; 3]>;

fn stl(bytes: &[u8]) -> Result<Corners, MeshFault> {
    let fault = |error: std::io::Error| MeshFault::new(format!("this is no STL file: {error}"), EXPORT);
    let mut cursor = Cursor::new(bytes);
    let triangles = stl_io::create_stl_reader(&mut cursor).map_err(fault)?;
    // One more than allowed is enough to refuse.
    let read: Result<Vec<_>, _> = triangles.take(MOST_TRIANGLES + 1).collect();
    let corners = |triangle: stl_io::Triangle| triangle.vertices.map(|vertex| vertex.0.map(f64::from));
    Ok(read.map_err(fault)?.into_iter().map(corners).collect())
}

fn obj(bytes: &[u8]) -> Result<Corners, MeshFault> {
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    // Materials have no part in a contact.
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(bytes), &options, |_| Ok(Default::default()))
        .map_err(|error| MeshFault::new(format!("this is no OBJ file: {error}"), EXPORT))?;
    let mut out = Corners::new();
    for mesh in models.iter().map(|model| &model.mesh) {
        let corner = |index: u32| -> Option<[f64; 3]> {
            let at = 3 * index as usize;
            let own = mesh.positions.get(at..at + 3)?;
            Some([own[0], own[1], own[2]].map(f64::from))
        };
        for triangle in mesh.indices.chunks_exact(3) {
            let corners = [corner(triangle[0]), corner(triangle[1]), corner(triangle[2])];
            let [Some(a), Some(b), Some(c)] = corners else {
                return Err(MeshFault::new("a face names a vertex that the file does not have", EXPORT));
            };
            out.push([a, b, c]);
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ASCII: &str = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n\
                         endfacet\nendsolid s\n";

    #[test]
    fn ascii_binary_and_obj_give_the_same_triangles() {
        let ascii = Triangles::read(ASCII.as_bytes(), Format::Stl, 1e-3).expect("ASCII STL");
        let mut binary = vec![0_u8; 80];
        binary.extend(1_u32.to_le_bytes());
        for number in [0.0_f32, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
            binary.extend(number.to_le_bytes());
        }
        binary.extend([0, 0]);
        assert_eq!(Triangles::read(&binary, Format::Stl, 1e-3).expect("binary STL"), ascii);
        let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        assert_eq!(Triangles::read(obj.as_bytes(), Format::Obj, 1e-3).expect("OBJ"), ascii);
        let text = ascii_stl(&binary).expect("binary STL");
        assert_eq!(Triangles::read(text.as_bytes(), Format::Stl, 1e-3).expect("its text"), ascii);
        assert_eq!(ascii.vertices[1], vec3(1e-3, 0.0, 0.0));
        assert_eq!(ascii.triangles, [[0, 1, 2]]);
    }

    #[test]
    fn what_is_no_mesh_is_refused_with_a_remedy() {
        let cases = [
            (&b"nothing"[..], Format::Stl, "no STL file"),
            (ASCII.replace("1 0 0", "nan 0 0").as_bytes(), Format::Stl, "no STL file"),
            (b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", Format::Obj, "not finite"),
            (b"solid s\nendsolid s\n", Format::Stl, "no triangles"),
            (b"v 0 0 0\nf 1 2 3\n", Format::Obj, "OBJ"),
        ]
        .map(|(bytes, format, expected)| (bytes.to_vec(), format, expected));
        for (bytes, format, expected) in cases {
            let fault = Triangles::read(&bytes, format, 1.0).expect_err(expected);
            assert!(fault.message.contains(expected) && fault.remedy == EXPORT, "{fault:?}");
        }
    }
}
