//! Elements of XML files.

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesStart, BytesText, Event};
use softdock_kernels::vector::{Pose, Quat, Vec3, vec3};

/// Writes an XML file into memory, indented; texts are escaped.
pub(crate) struct Xml(Writer<Vec<u8>>);

impl Xml {
    pub(crate) fn new() -> Self {
        let mut xml = Self(Writer::new_with_indent(Vec::new(), b' ', 2));
        xml.event(Event::Decl(BytesDecl::new("1.0", Some("utf-8"), None)));
        xml
    }

    /// Writes an element with attributes and content.
    pub(crate) fn element(&mut self, name: &str, attributes: &[(&str, &str)], content: impl FnOnce(&mut Self)) {
        let start = BytesStart::new(name).with_attributes(attributes.iter().copied());
        self.event(Event::Start(start.borrow()));
        content(self);
        self.event(Event::End(start.to_end()));
    }

    /// Writes an element without content.
    pub(crate) fn empty(&mut self, name: &str, attributes: &[(&str, &str)]) {
        self.event(Event::Empty(BytesStart::new(name).with_attributes(attributes.iter().copied())));
    }

    /// Writes a comment.
    pub(crate) fn comment(&mut self, text: &str) {
        // A comment has no two hyphens in a row.
        self.event(Event::Comment(BytesText::from_escaped(format!(" {} ", text.replace('-', "‐")))));
    }

    /// The file's text.
    pub(crate) fn text(self) -> String {
        String::from_utf8(self.0.into_inner()).expect("texts were written") + "\n"
    }

    fn event(&mut self, event: Event<'_>) {
        self.0.write_event(event).expect("memory takes every event");
    }
}

/// Numbers apart by spaces, each with the digits that it needs.
pub(crate) fn numbers(values: &[f64]) -> String {
    values.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}

/// A vector.
pub(crate) fn vector(v: Vec3<f64>) -> String {
    numbers(&[v.x, v.y, v.z])
}

/// A quaternion, its scalar first.
pub(crate) fn quaternion(q: Quat<f64>) -> String {
    numbers(&[q.w, q.v.x, q.v.y, q.v.z])
}

/// A place turned so that its z is along x of the given one: formats have their cylinders along z.
pub(crate) fn upright(place: &Pose<f64>) -> Pose<f64> {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    place.compose(Pose { position: Vec3::zero(), attitude: Quat { w: half, v: vec3(0.0, half, 0.0) } })
}
