// Replay of a run: space and facility side by side, with contact forces, on one time line.

import {
    AmbientLight,
    ArrowHelper,
    BoxGeometry,
    BufferGeometry,
    CapsuleGeometry,
    CircleGeometry,
    Color,
    CylinderGeometry,
    DirectionalLight,
    DoubleSide,
    EdgesGeometry,
    Float32BufferAttribute,
    FrontSide,
    Group,
    LatheGeometry,
    LineBasicMaterial,
    LineSegments,
    Mesh,
    MeshLambertMaterial,
    PerspectiveCamera,
    Quaternion,
    Scene as World,
    SphereGeometry,
    TorusGeometry,
    Vector2,
    Vector3,
    WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Data, Place, Poses, Robot, Scene, Solid, Trace } from "./data";
import { button, el, select } from "./dom";
import { significant } from "./format";
import { colours } from "./theme";
import { endOf, traceName, type TraceView } from "./traces";

/** Where the outline of a hole is cut off, over the radius of its mouth. */
const RIM = 1.3;

/** Poses over time. */
class Motion {
    readonly time: Float32Array;
    private readonly columns = new Map<string, Float32Array>();
    private index = 0;
    private share = 0;

    constructor(data: Data, poses: Poses) {
        this.time = data.f32(poses.time);
        const [steps, count] = [data.i16(poses.steps), this.time.length];
        poses.names.forEach((name, at) => {
            const [lo, hi] = poses.ranges[at];
            const values = new Float32Array(count);
            let code = 0;
            for (let instant = 0; instant < count; instant++) {
                // The steps wrap around at 16 bits.
                code = ((code + steps[at * count + instant]) << 16) >> 16;
                values[instant] = lo + ((hi - lo) * (code + 32767)) / 65534;
            }
            this.columns.set(name, values);
        });
    }

    has(name: string): boolean {
        return this.columns.has(name);
    }

    /** Goes to a time; instants between two are interpolated. */
    seek(time: number): void {
        const last = this.time.length - 1;
        let [lo, hi] = [0, last];
        while (hi - lo > 1) {
            const middle = (lo + hi) >> 1;
            if (this.time[middle] <= time) lo = middle;
            else hi = middle;
        }
        this.index = Math.min(lo, Math.max(0, last - 1));
        const [from, to] = [this.time[this.index], this.time[Math.min(last, this.index + 1)]];
        this.share = to > from ? Math.min(1, Math.max(0, (time - from) / (to - from))) : 0;
    }

    value(name: string): number {
        const values = this.columns.get(name);
        if (!values) return 0;
        const next = Math.min(values.length - 1, this.index + 1);
        return values[this.index] + this.share * (values[next] - values[this.index]);
    }

    vector(name: string, suffix: string, into: Vector3): Vector3 {
        return into.set(this.value(`${name}_x${suffix}`), this.value(`${name}_y${suffix}`), this.value(`${name}_z${suffix}`));
    }

    pose(name: string, group: Group): void {
        this.vector(`${name}_position`, "_m", group.position);
        const attitude = (at: number) => {
            const own = (letter: string) => this.columns.get(`${name}_attitude_${letter}`)?.[at] ?? 0;
            return new Quaternion(own("x"), own("y"), own("z"), own("w"));
        };
        group.quaternion.copy(attitude(this.index)).normalize();
        group.quaternion.slerp(attitude(Math.min(this.time.length - 1, this.index + 1)).normalize(), this.share);
    }

    /** Greatest magnitude of a force. */
    peak(name: string): number {
        const [x, y, z] = ["x", "y", "z"].map((letter) => this.columns.get(`${name}_${letter}_n`));
        if (!x || !y || !z) return 0;
        return x.reduce((most, own, at) => Math.max(most, Math.hypot(own, y[at], z[at])), 0);
    }
}

function placed(group: Group, [x, y, z, a, b, c, w]: Place): Group {
    group.position.set(x, y, z);
    group.quaternion.set(a, b, c, w);
    return group;
}

/** Geometry of a solid, round ones about x. */
function geometry(solid: Solid, reach: number): BufferGeometry {
    switch (solid.shape) {
        case "plane":
            return new CircleGeometry(1.5 * reach, 48).rotateY(-Math.PI / 2);
        case "sphere":
            return new SphereGeometry(solid.radius, 32, 20);
        case "box":
            return new BoxGeometry(...solid.half.map((half) => 2 * half));
        case "capsule":
            return new CapsuleGeometry(solid.radius, solid.length, 8, 24).rotateZ(-Math.PI / 2);
        case "frustum": {
            const [from, to] = solid.along;
            return new CylinderGeometry(solid.radii[1], solid.radii[0], to - from, 40).rotateZ(-Math.PI / 2).translate((from + to) / 2, 0, 0);
        }
        case "ring":
            return new TorusGeometry(solid.radius, solid.tube, 16, 60).rotateY(Math.PI / 2);
        case "hole": {
            const mouth = Math.max(...solid.outline.map(([, radius]) => radius));
            const outline = [[0, RIM * mouth], ...solid.outline].map(([along, radius]) => new Vector2(Math.max(radius, 1e-6), along));
            return new LatheGeometry(outline, 48).rotateZ(-Math.PI / 2);
        }
        case "mesh": {
            const own = new BufferGeometry();
            own.setAttribute("position", new Float32BufferAttribute(solid.vertices.flat(), 3));
            own.setIndex(solid.triangles.flat());
            own.computeVertexNormals();
            return own;
        }
    }
}

function body(shape: BufferGeometry, colour: string, opacity = 1, edges = 25): Group {
    const group = new Group();
    // A view from inside a large box sees through it.
    const side = opacity < 0.3 ? FrontSide : DoubleSide;
    const material = new MeshLambertMaterial({ color: new Color(colour), side, transparent: opacity < 1, opacity, depthWrite: opacity >= 1 });
    group.add(new Mesh(shape, material));
    group.add(new LineSegments(new EdgesGeometry(shape, edges), new LineBasicMaterial({ color: new Color(colour).multiplyScalar(0.6), transparent: true, opacity: 0.7 })));
    return group;
}

function part(scene: Scene, side: 0 | 1, colour: string): Group {
    const group = new Group();
    const { points, solids } = scene.parts[side];
    for (const [[x, y, z], radius] of points) {
        const dot = new Mesh(new SphereGeometry(Math.max(radius, 0.012 * scene.reach), 20, 14), new MeshLambertMaterial({ color: new Color(colour) }));
        dot.position.set(x, y, z);
        group.add(dot);
    }
    for (const solid of solids) {
        const open = solid.shape === "hole" || solid.shape === "plane";
        group.add(placed(body(geometry(solid, scene.reach), colour, open ? 0.55 : 1), solid.place));
    }
    return group;
}

const UP = new Vector3(0, 1, 0);

/** A link between two points. */
class Link {
    readonly mesh: Mesh;

    constructor(private readonly radius: number, colour: string) {
        this.mesh = new Mesh(new CylinderGeometry(1, 1, 1, 20), new MeshLambertMaterial({ color: new Color(colour) }));
    }

    set(from: Vector3, to: Vector3): void {
        const along = to.clone().sub(from);
        const length = along.length();
        this.mesh.visible = length > 1e-6;
        this.mesh.scale.set(this.radius, Math.max(length, 1e-6), this.radius);
        this.mesh.position.copy(from).addScaledVector(along, 0.5);
        if (length > 1e-6) this.mesh.quaternion.setFromUnitVectors(UP, along.divideScalar(length));
    }
}

/** One side of the replay. */
class View {
    readonly world = new World();
    readonly camera = new PerspectiveCamera(38, 1.5, 0.005, 500);
    readonly element: HTMLElement;
    private readonly renderer: WebGLRenderer;
    private readonly controls: OrbitControls;
    private readonly arrow: ArrowHelper;
    protected readonly partA: Group;
    protected readonly partB: Group;
    private readonly centre = new Vector3();
    dirty = true;

    constructor(title: string, protected readonly scene: Scene, private readonly force: string) {
        const now = colours();
        this.renderer = new WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
        this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
        const canvas = this.renderer.domElement;
        canvas.setAttribute("role", "img");
        canvas.setAttribute("aria-label", `${title}: parts, bodies and contact force in three dimensions`);
        const save = button("PNG", () => {
            this.renderer.render(this.world, this.camera);
            el("a", { href: canvas.toDataURL("image/png"), download: `replay-${title.replaceAll(" ", "-")}.png` }).click();
        }, { "aria-label": `Save as PNG: ${title}` });
        this.element = el("figure", { class: "replay-view figure" }, canvas, el("figcaption", {}, el("span", {}, title), el("span", { class: "save" }, save)));
        const sun = new DirectionalLight(0xffffff, 2.0);
        sun.position.set(-2, -3, 4);
        this.world.add(new AmbientLight(0xffffff, 1.5), sun);
        this.partA = part(scene, 0, now.space);
        this.partB = part(scene, 1, now.facility);
        this.arrow = new ArrowHelper(new Vector3(1, 0, 0), new Vector3(), 1, new Color(now.limit));
        // The force is seen through the parts.
        for (const own of [this.arrow.line, this.arrow.cone]) {
            own.renderOrder = 9;
            for (const material of [own.material].flat()) Object.assign(material, { depthTest: false, transparent: true });
        }
        this.world.add(this.partA, this.partB, this.arrow);
        this.camera.up.set(0, 0, 1);
        this.controls = new OrbitControls(this.camera, canvas);
        this.controls.enableZoom = true;
        // The page scrolls on; the wheel zooms with Ctrl alone.
        canvas.addEventListener("wheel", (event) => {
            if (!event.ctrlKey) event.stopImmediatePropagation();
        }, { capture: true });
        this.controls.addEventListener("change", () => (this.dirty = true));
        new ResizeObserver(() => this.resize()).observe(this.element);
    }

    private resize(): void {
        const width = this.element.clientWidth;
        if (width === 0) return;
        const height = Math.round(Math.min(0.72 * width, 380));
        this.renderer.setSize(width, height, true);
        this.renderer.domElement.style.width = "100%";
        this.camera.aspect = width / height;
        this.camera.updateProjectionMatrix();
        this.dirty = true;
    }

    /** Looks at part B from the side, from so far \[m\]. */
    look(distance: number, from: Vector3): void {
        this.controls.target.copy(this.centre);
        this.camera.position.copy(this.centre).addScaledVector(from.normalize(), distance);
        this.controls.update();
        this.dirty = true;
    }

    /** Puts everything where it is; the view follows part B. */
    place(motion: Motion, peak: number, isOver: boolean): void {
        this.pose(motion);
        const moved = this.partB.position.clone().sub(this.centre);
        this.centre.copy(this.partB.position);
        this.controls.target.add(moved);
        this.camera.position.add(moved);
        const force = motion.vector(this.force, "_n", new Vector3());
        const size = force.length();
        this.arrow.visible = !isOver && size > 1e-3 * peak;
        if (this.arrow.visible) {
            const length = (2.2 * this.scene.reach * size) / peak + 0.15 * this.scene.reach;
            this.arrow.position.copy(this.partA.position);
            this.arrow.setDirection(force.divideScalar(size));
            this.arrow.setLength(length, Math.min(0.4 * length, 0.3 * this.scene.reach), 0.18 * this.scene.reach);
        }
        this.dirty = true;
    }

    protected pose(_motion: Motion): void {}

    render(): void {
        if (!this.dirty) return;
        this.dirty = false;
        this.renderer.setClearColor(new Color(colours().paper), 1);
        this.renderer.render(this.world, this.camera);
    }
}

class SpaceView extends View {
    private readonly base = new Group();
    private readonly target = new Group();
    private readonly links: Link[];
    private readonly joints: Group[];

    constructor(scene: Scene) {
        super("in space", scene, "space_contact_force");
        const now = colours();
        this.base.add(body(new BoxGeometry(...scene.boxes[0]), now.soft, 0.16));
        this.target.add(body(new BoxGeometry(...scene.boxes[1]), now.facility, 0.12));
        const thick = 0.05 + 0.02 * scene.joints.length;
        this.links = Array.from({ length: scene.joints.length + 1 }, () => new Link(scene.joints.length > 0 ? 0.25 * thick : 0.012, now.soft));
        this.joints = scene.joints.map(() => new Group());
        const ball = new SphereGeometry(0.4 * thick, 18, 12);
        this.joints.forEach((joint) => joint.add(new Mesh(ball, new MeshLambertMaterial({ color: new Color(now.soft) }))));
        this.world.add(this.base, this.target, ...this.joints, ...this.links.map((link) => link.mesh));
    }

    protected override pose(motion: Motion): void {
        motion.pose("space_base", this.base);
        motion.pose("space_part_b", this.partB);
        const at = { position: this.base.position.clone(), quaternion: this.base.quaternion.clone() };
        const step = (place: Place) => {
            at.position.add(new Vector3(place[0], place[1], place[2]).applyQuaternion(at.quaternion));
            at.quaternion.multiply(new Quaternion(place[3], place[4], place[5], place[6]));
        };
        let before = at.position.clone();
        this.scene.joints.forEach(({ origin, slides }, joint) => {
            step(origin);
            const value = motion.value(`space_joint_${joint + 1}_${slides ? "m" : "rad"}`);
            if (slides) at.position.add(new Vector3(0, 0, value).applyQuaternion(at.quaternion));
            else at.quaternion.multiply(new Quaternion(0, 0, Math.sin(value / 2), Math.cos(value / 2)));
            this.joints[joint].position.copy(at.position);
            this.links[joint].set(before, at.position);
            before = at.position.clone();
        });
        step(this.scene.tool);
        this.links[this.scene.joints.length].set(before, at.position);
        this.partA.position.copy(at.position);
        this.partA.quaternion.copy(at.quaternion);
        // The target lies behind part B: its frame is that of part B without the seat.
        const [x, y, z, a, b, c, w] = this.scene.seat;
        this.target.quaternion.copy(this.partB.quaternion).multiply(new Quaternion(a, b, c, w).invert());
        this.target.position.copy(this.partB.position).sub(new Vector3(x, y, z).applyQuaternion(this.target.quaternion));
    }
}

class Arm {
    readonly root = new Group();
    private readonly joints: Group[];

    constructor(private readonly robot: Robot, private readonly name: string, colour: string) {
        placed(this.root, robot.base);
        const pedestal = body(new CylinderGeometry(0.32, 0.36, 0.08, 32).rotateX(Math.PI / 2), colour, 1);
        this.root.add(pedestal);
        let parent: Group = this.root;
        this.joints = robot.joints.map(({ origin }) => {
            const frame = placed(new Group(), origin);
            const joint = new Group();
            frame.add(joint);
            parent.add(frame);
            parent = joint;
            return joint;
        });
        const material = new MeshLambertMaterial({ color: new Color(colour) });
        for (const { joint, from, to, radius } of robot.capsules) {
            const [one, two] = [new Vector3(...from), new Vector3(...to)];
            const along = two.clone().sub(one);
            const length = along.length();
            // Capsules enclose the links; the drawing is slimmer, so that joints are seen.
            const mesh = new Mesh(new CapsuleGeometry(0.62 * radius, length, 6, 20), material);
            mesh.position.copy(one).addScaledVector(along, 0.5);
            if (length > 1e-9) mesh.quaternion.setFromUnitVectors(UP, along.divideScalar(length));
            this.joints[joint]?.add(mesh);
        }
        const hand = new Vector3(robot.tool[0], robot.tool[1], robot.tool[2]);
        if (hand.length() > 1e-6 && this.joints.length > 0) {
            const tool = new Link(0.05, colour);
            tool.set(new Vector3(), hand);
            this.joints[this.joints.length - 1].add(tool.mesh);
        }
    }

    pose(motion: Motion): void {
        const { base, rail, joints } = this.robot;
        const shift = rail ? motion.value(`${this.name}_rail_m`) : 0;
        const [x, y, z] = rail ?? [0, 0, 0];
        this.root.position.set(base[0] + shift * x, base[1] + shift * y, base[2] + shift * z);
        this.joints.forEach((joint, at) => {
            const angle = joints[at].sign * motion.value(`${this.name}_axis_${at + 1}_rad`);
            joint.quaternion.set(0, 0, Math.sin(angle / 2), Math.cos(angle / 2));
        });
    }
}

class FacilityView extends View {
    private readonly arms: Arm[];

    constructor(scene: Scene) {
        super("on the facility", scene, "hil_contact_force");
        const colour = colours().soft;
        this.arms = (scene.robots ?? []).map((robot, at) => new Arm(robot, `robot${at + 1}`, colour));
        for (const arm of this.arms) this.world.add(arm.root);
    }

    protected override pose(motion: Motion): void {
        motion.pose("robots_part_a", this.partA);
        motion.pose("robots_part_b", this.partB);
        this.arms.forEach((arm) => arm.pose(motion));
    }
}

/** Playing speeds, as multiples of the time of the run. */
const SPEEDS = [0.02, 0.1, 0.25, 1, 4];

export function replay(data: Data, traces: TraceView, onTheme: (listener: () => void) => void): HTMLElement {
    const heading = el("h3", {}, "Replay");
    const { scene } = data.head;
    const views: View[] = [];
    const holder = el("div", { class: "replay-views" });
    const message = el("p", { class: "soft", role: "status" });
    let motion: Motion | null = null;
    let [time, peak, playing, speed, last] = [0, 1, false, 1, 0];
    // When the loops ended.
    let ends: [number, number] = [Infinity, Infinity];

    const clock = el("output", { "aria-live": "off" }, "");
    const slider = el("input", { type: "range", min: 0, max: 1, step: "any", value: 0, "aria-label": "Time of the run", input: () => seek(Number(slider.value)) });
    const play = button("Play", () => setPlaying(!playing));
    const setPlaying = (on: boolean) => {
        playing = on && motion !== null;
        play.textContent = playing ? "Pause" : "Play";
        if (!playing || !motion) return;
        if (time >= motion.time[motion.time.length - 1]) time = data.head.traces.length > 0 ? traces.current().contact[0] : 0;
        last = performance.now();
        requestAnimationFrame(frame);
    };
    const seek = (to: number) => {
        if (!motion) return;
        time = Math.min(motion.time[motion.time.length - 1], Math.max(motion.time[0], to));
        slider.value = String(time);
        clock.textContent = `${significant(time, 5)} s`;
        slider.setAttribute("aria-valuetext", clock.textContent);
        motion.seek(time);
        views.forEach((view, at) => view.place(motion as Motion, peak, time > ends[at]));
        traces.setCursor(time);
        draw();
    };
    const frame = (now: number) => {
        if (!playing || !motion) return;
        const next = time + (speed * (now - last)) / 1000;
        last = now;
        seek(next);
        if (time >= motion.time[motion.time.length - 1]) setPlaying(false);
        else requestAnimationFrame(frame);
    };
    let asked = false;
    const draw = () => {
        if (asked) return;
        asked = true;
        requestAnimationFrame(() => {
            asked = false;
            for (const view of views) view.render();
        });
    };

    const near = () => views.forEach((view) => view.look(9 * (scene?.reach ?? 1), new Vector3(-0.45, -1, 0.45)));
    const whole = () => views.forEach((view, at) => view.look(at === 0 ? Math.max(...(scene?.boxes.flat() ?? [2]), 2) * 4.2 : 7.5, new Vector3(-0.35, -1, 0.4)));
    const side = () => views.forEach((view) => view.look(9 * (scene?.reach ?? 1), new Vector3(0, -1, 0.001)));
    const make = () => {
        if (!scene || views.length > 0) return;
        if (!document.createElement("canvas").getContext("webgl2")) {
            message.textContent = "This browser draws no three dimensions (WebGL is off): there is no replay.";
            return;
        }
        views.push(new SpaceView(scene), new FacilityView(scene));
        holder.replaceChildren(...views.map((view) => view.element));
        for (const view of views) view.element.addEventListener("pointermove", draw);
        for (const view of views) view.element.addEventListener("wheel", draw);
        new ResizeObserver(draw).observe(holder);
    };
    const load = (trace: Trace) => {
        setPlaying(false);
        motion = scene && trace.poses ? new Motion(data, trace.poses) : null;
        controls.hidden = holder.hidden = motion === null;
        traces.setCursor(null);
        heading.textContent = `Replay: ${traceName(trace)}`;
        if (!motion) {
            message.textContent = `The time history of ${traceName(trace)} has no poses: it was written by an earlier version of softdock. Run the campaign again with --fresh, or make this one with softdock replay.`;
            return;
        }
        ends = [endOf(data, trace, "space"), endOf(data, trace, "facility")];
        const last = motion.time[motion.time.length - 1];
        const over = ends.map((own, at) => (own < last ? `${at === 0 ? "The loop in space" : "The session on the facility"} ends at ${significant(own, 4)} s.` : "")).filter(Boolean);
        message.textContent = [...over, scene?.robots ? "" : "The facility of this campaign states no robots: only the parts are shown on its side."].filter(Boolean).join(" ");
        make();
        if (views.length === 0) {
            controls.hidden = true;
            return;
        }
        slider.min = String(motion.time[0]);
        slider.max = String(last);
        peak = Math.max(motion.peak("space_contact_force"), motion.peak("hil_contact_force"), 1e-9);
        seek(trace.contact[0]);
        near();
        draw();
    };
    const speeds = SPEEDS.map((own) => ({ value: String(own), text: `\u00d7 ${own}` }));
    const controls = el(
        "div",
        {},
        el("div", { class: "timeline" }, play, slider, clock, select("Speed", speeds, String(speed), (value) => (speed = Number(value)))),
        el("div", { class: "row" }, el("span", { class: "soft" }, "View"), button("Parts", () => (near(), draw())), button("Side", () => (side(), draw())), button("Whole scene", () => (whole(), draw()))),
    );
    const note = el("p", { class: "note" }, "Part A is blue, part B orange; the arrow is the contact force on part A, with one scale for both sides. Base and target are drawn as solid boxes with their nominal mass and inertia, the robots' links as slimmed capsules of their model. Drag to turn, hold Ctrl and turn the wheel to zoom.");
    const element = el("div", {}, heading, message, holder, controls, note);
    if (!scene) {
        message.textContent = "The page was written without the scenario: there is no replay.";
        controls.hidden = true;
        return element;
    }
    traces.onTrace(load);
    traces.onTime(seek);
    onTheme(() => {
        views.forEach((view) => (view.dirty = true));
        draw();
    });
    // Three dimensions are set up when they come into view.
    new IntersectionObserver((entries, observer) => {
        if (entries.some((entry) => entry.isIntersecting)) {
            observer.disconnect();
            load(traces.current());
        }
    }, { rootMargin: "200px" }).observe(element);
    return element;
}
