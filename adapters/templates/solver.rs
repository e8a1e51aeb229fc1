//! my-name: a complete calibrator for `calibench gate`, in Rust and nothing else.
//!
//!     rustc --edition 2021 -O -o my-name my-name.rs
//!     calibench gate --solver ./my-name
//!
//! It reads problems, a JSON object a line, and writes answers, a JSON object a line. `main`, `answer` and
//! the JSON at the end can stay; put your own calibrator in the place of `solve`. What it does now:
//! homographies, a focal length from them, and Gauss-Newton with Levenberg's damping and numerical
//! derivatives (Zhang 2000). It states its covariance, and refuses what it cannot solve.

use std::io::{BufRead, Write};

type Vector = Vec<f64>;
type Matrix = Vec<Vector>;
/// `Err` is why there is no answer, as it is told.
type Refusable<T> = Result<T, String>;

fn refused<T>(why: &str) -> Refusable<T> {
    Err(why.to_string())
}

// --- What is asked -----------------------------------------------------------------------------------

const NAMES: [&str; 10] = ["fx", "fy", "cx", "cy", "skew", "k1", "k2", "p1", "p2", "k3"];
/// Values in the order of `NAMES`.
type Camera = [f64; 10];

#[derive(Clone)]
struct View {
    target: Vec<[f64; 2]>,
    pixels: Vec<[f64; 2]>,
}

#[derive(Clone)]
struct Problem {
    image_size: [f64; 2],
    views: Vec<View>,
    /// Places in `NAMES`.
    free: Vec<usize>,
    /// Places in `NAMES`, and values.
    held: Vec<(usize, f64)>,
}

/// X_camera = rotation X_target + translation.
#[derive(Clone)]
struct Pose {
    rotation: [[f64; 3]; 3],
    translation: [f64; 3],
}

struct Answer {
    converged: bool,
    camera: Camera,
    poses: Vec<Pose>,
    /// Of the free parameters.
    covariance: Matrix,
    rmse: f64,
}

// --- Linear algebra ----------------------------------------------------------------------------------

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// The lower factor L of a positive definite matrix, A = L L'.
fn cholesky(mut a: Matrix) -> Refusable<Matrix> {
    for j in 0..a.len() {
        for i in j..a.len() {
            a[i][j] -= dot(&a[i][..j], &a[j][..j]);
        }
        // A NaN is not positive either.
        if !(a[j][j] > 0.0) {
            return refused("the data do not determine the parameters");
        }
        let root = a[j][j].sqrt();
        a[j..].iter_mut().for_each(|row| row[j] /= root);
    }
    Ok(a)
}

/// The solution of L L' x = b.
fn solved(l: &Matrix, mut b: Vector) -> Vector {
    let n = b.len();
    for i in 0..n {
        b[i] = (b[i] - dot(&l[i][..i], &b[..i])) / l[i][i];
    }
    for i in (0..n).rev() {
        let below: f64 = (i + 1..n).map(|k| l[k][i] * b[k]).sum();
        b[i] = (b[i] - below) / l[i][i];
    }
    b
}

fn inverse(a: &Matrix) -> Refusable<Matrix> {
    let (n, l) = (a.len(), cholesky(a.clone())?);
    let unit = |i| (0..n).map(|k| if k == i { 1.0 } else { 0.0 }).collect();
    Ok((0..n).map(|i| solved(&l, unit(i))).collect())
}

/// The largest eigenvalue of a symmetric matrix, by repeated multiplication: a few per cent are enough here.
fn largest_eigenvalue(a: &Matrix) -> f64 {
    let mut x: Vector = (0..a.len()).map(|i| 1.0 + 0.1 * (i % 7) as f64).collect();
    let mut length = 0.0;
    for _ in 0..50 {
        let y: Vector = a.iter().map(|row| dot(row, &x)).collect();
        length = norm(&y);
        x = y.iter().map(|v| v / length).collect();
    }
    length
}

/// Least squares of rows . x = right, by the normal equations.
fn least_squares(rows: &[Vector], right: &[f64]) -> Refusable<Vector> {
    let n = rows[0].len();
    let mut normal = vec![vec![0.0; n]; n];
    let mut b = vec![0.0; n];
    for (row, value) in rows.iter().zip(right) {
        for i in 0..n {
            b[i] += row[i] * value;
            for k in 0..n {
                normal[i][k] += row[i] * row[k];
            }
        }
    }
    Ok(solved(&cholesky(normal)?, b))
}

// --- The camera --------------------------------------------------------------------------------------

/// A pose after a step: exp(w) on the left of its rotation (Rodrigues), and a shift. The step is w, then the
/// shift.
fn moved(pose: &Pose, step: &[f64]) -> Pose {
    let angle = norm(&step[..3]);
    let (s, c) = match angle < 1e-9 {
        true => (1.0, 0.5),
        false => (angle.sin() / angle, (1.0 - angle.cos()) / (angle * angle)),
    };
    let [wx, wy, wz] = [step[0], step[1], step[2]];
    let cross = |v: [f64; 3]| [wy * v[2] - wz * v[1], wz * v[0] - wx * v[2], wx * v[1] - wy * v[0]];
    let mut next = pose.clone();
    for j in 0..3 {
        let column = [0, 1, 2].map(|i| pose.rotation[i][j]);
        let once = cross(column);
        let twice = cross(once);
        for i in 0..3 {
            next.rotation[i][j] = column[i] + s * once[i] + c * twice[i];
        }
    }
    for i in 0..3 {
        next.translation[i] += step[3 + i];
    }
    next
}

/// The pixel of a point of the target; the equations are those of the protocol.
fn project(camera: &Camera, pose: &Pose, at: [f64; 2]) -> [f64; 2] {
    let [fx, fy, cx, cy, skew, k1, k2, p1, p2, k3] = *camera;
    let p = [0, 1, 2].map(|i| dot(&pose.rotation[i][..2], &at) + pose.translation[i]);
    let (x, y) = (p[0] / p[2], p[1] / p[2]);
    let s = x * x + y * y;
    let g = 1.0 + s * (k1 + s * (k2 + s * k3));
    let xd = x * g + 2.0 * p1 * x * y + p2 * (s + 2.0 * x * x);
    let yd = y * g + p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y;
    [fx * xd + skew * yd + cx, fy * yd + cy]
}

// --- The start ---------------------------------------------------------------------------------------

/// The middle of points, and what makes their mean distance from it sqrt(2).
fn middle_and_scale(points: &[[f64; 2]]) -> Refusable<([f64; 2], f64)> {
    let n = points.len() as f64;
    let middle = [0, 1].map(|i| points.iter().map(|p| p[i]).sum::<f64>() / n);
    let distance = |p: &[f64; 2]| (p[0] - middle[0]).hypot(p[1] - middle[1]);
    let size = points.iter().map(distance).sum::<f64>() / n;
    if size > 0.0 {
        Ok((middle, 2f64.sqrt() / size))
    } else {
        refused("all points of a view are one")
    }
}

/// From the target's plane to pixels relative to (cx, cy), by the direct linear transform with both sides
/// about their middle.
fn homography(view: &View, cx: f64, cy: f64) -> Refusable<[[f64; 3]; 3]> {
    let (t, t_scale) = middle_and_scale(&view.target)?;
    let (u, u_scale) = middle_and_scale(&view.pixels)?;
    let (mut rows, mut right) = (Matrix::new(), Vector::new());
    for (target, pixel) in view.target.iter().zip(&view.pixels) {
        let [x, y] = [0, 1].map(|i| t_scale * (target[i] - t[i]));
        let [a, b] = [0, 1].map(|i| u_scale * (pixel[i] - u[i]));
        rows.push(vec![x, y, 1.0, 0.0, 0.0, 0.0, -a * x, -a * y]);
        rows.push(vec![0.0, 0.0, 0.0, x, y, 1.0, -b * x, -b * y]);
        right.extend([a, b]);
    }
    let h = least_squares(&rows, &right)?;
    // The target's side: x = t_scale (X - t).
    let of_target = [[h[0], h[1], h[2]], [h[3], h[4], h[5]], [h[6], h[7], 1.0]]
        .map(|[a, b, c]| [t_scale * a, t_scale * b, c - t_scale * (t[0] * a + t[1] * b)]);
    let pixel_row = |i: usize, centre: f64| {
        [0, 1, 2].map(|j| of_target[i][j] / u_scale + (u[i] - centre) * of_target[2][j])
    };
    let rows = [pixel_row(0, cx), pixel_row(1, cy), of_target[2]];
    let length = norm(rows.as_flattened());
    Ok(rows.map(|row| row.map(|v| v / length)))
}

/// The pose behind a homography: two columns of the rotation, the translation, in front of the camera.
fn pose_of(h: &[[f64; 3]; 3], fx: f64, fy: f64) -> Pose {
    let columns = [0, 1, 2].map(|j| [h[0][j] / fx, h[1][j] / fy, h[2][j]]);
    let sign = if columns[2][2] < 0.0 { -1.0 } else { 1.0 };
    let scale = sign * 2.0 / (norm(&columns[0]) + norm(&columns[1]));
    let [first, second, translation] = columns.map(|column| column.map(|v| v * scale));
    let a = first.map(|v| v / norm(&first));
    let along = dot(&a, &second);
    let across = [0, 1, 2].map(|i| second[i] - along * a[i]);
    let b = across.map(|v| v / norm(&across));
    let c = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    Pose { rotation: [0, 1, 2].map(|i| [a[i], b[i], c[i]]), translation }
}

struct State {
    camera: Camera,
    poses: Vec<Pose>,
}

/// The focal lengths with the principal point in the image's middle: columns of K^-1 H are perpendicular and
/// equally long.
fn start(problem: &Problem) -> Refusable<State> {
    let mut camera = [0.0; 10];
    camera[2] = (problem.image_size[0] - 1.0) / 2.0;
    camera[3] = (problem.image_size[1] - 1.0) / 2.0;
    for &(place, value) in &problem.held {
        camera[place] = value;
    }
    let found: Refusable<Vec<_>> =
        problem.views.iter().map(|v| homography(v, camera[2], camera[3])).collect();
    let homographies = found?;
    let (mut rows, mut right) = (Matrix::new(), Vector::new());
    for [x, y, z] in &homographies {
        rows.push(vec![x[0] * x[1], y[0] * y[1]]);
        right.push(-z[0] * z[1]);
        rows.push(vec![x[0] * x[0] - x[1] * x[1], y[0] * y[0] - y[1] * y[1]]);
        right.push(z[1] * z[1] - z[0] * z[0]);
    }
    // Parallel planes: any focal length will do to begin with.
    let inverse_squares = least_squares(&rows, &right).unwrap_or(vec![0.0; 2]);
    for i in 0..2 {
        if problem.free.contains(&i) {
            let found = inverse_squares[i] > 0.0;
            camera[i] = if found { 1.0 / inverse_squares[i].sqrt() } else { problem.image_size[0] };
        }
    }
    let poses = homographies.iter().map(|h| pose_of(h, camera[0], camera[1])).collect();
    Ok(State { camera, poses })
}

// --- The refinement ----------------------------------------------------------------------------------

fn stepped(state: &State, free: &[usize], step: &[f64]) -> State {
    let mut camera = state.camera;
    for (place, change) in free.iter().zip(step) {
        camera[*place] += change;
    }
    let of_poses = step[free.len()..].chunks(6);
    State { camera, poses: state.poses.iter().zip(of_poses).map(|(pose, s)| moved(pose, s)).collect() }
}

fn residuals(views: &[View], state: &State) -> Vector {
    let mut r = Vector::new();
    for (view, pose) in views.iter().zip(&state.poses) {
        for (target, pixel) in view.target.iter().zip(&view.pixels) {
            let [u, v] = project(&state.camera, pose, *target);
            r.extend([u - pixel[0], v - pixel[1]]);
        }
    }
    r
}

/// Normal equations and gradient by central differences; a pose moves the pixels of its own view only.
fn linearise(views: &[View], state: &State, free: &[usize], r: &[f64]) -> (Matrix, Vector) {
    let n = free.len() + 6 * views.len();
    let (mut normal, mut gradient) = (vec![vec![0.0; n]; n], vec![0.0; n]);
    let mut residual = r.chunks(2);
    for (v, view) in views.iter().enumerate() {
        let own = free.len() + 6 * v;
        let places: Vec<usize> = (0..free.len()).chain(own..own + 6).collect();
        // Camera and pose, a step to either side along every parameter, and how far apart the two are.
        let pairs: Vec<_> = (0..places.len())
            .map(|k| {
                let size = free.get(k).map_or(1.0, |place| state.camera[*place].abs().max(1.0));
                let side = |h: f64| {
                    let (mut camera, mut step) = (state.camera, [0.0; 6]);
                    match free.get(k) {
                        Some(place) => camera[*place] += h,
                        None => step[k - free.len()] = h,
                    }
                    (camera, moved(&state.poses[v], &step))
                };
                (side(1e-6 * size), side(-1e-6 * size), 2e-6 * size)
            })
            .collect();
        for (at, r) in view.target.iter().zip(residual.by_ref()) {
            let slope = |(up, down, width): &((Camera, Pose), (Camera, Pose), f64)| {
                let (up, down) = (project(&up.0, &up.1, *at), project(&down.0, &down.1, *at));
                [(up[0] - down[0]) / width, (up[1] - down[1]) / width]
            };
            let slopes: Vec<[f64; 2]> = pairs.iter().map(slope).collect();
            for (i, a) in places.iter().zip(&slopes) {
                gradient[*i] += dot(a, r);
                for (k, b) in places.iter().zip(&slopes) {
                    normal[*i][*k] += dot(a, b);
                }
            }
        }
    }
    (normal, gradient)
}

/// Divides rows and columns by the roots of the diagonal, so that units do not matter.
fn equilibrate(normal: &mut Matrix) -> Refusable<Vector> {
    let scale: Vector = (0..normal.len()).map(|i| normal[i][i].sqrt()).collect();
    if !scale.iter().all(|s| *s > 0.0) {
        return refused("a parameter has no influence");
    }
    for (row, a) in normal.iter_mut().zip(&scale) {
        row.iter_mut().zip(&scale).for_each(|(value, b)| *value /= a * b);
    }
    Ok(scale)
}

/// The problem with a target of unit size, which makes rotations and translations alike; and the unit.
fn checked(problem: &Problem) -> Refusable<(Problem, f64)> {
    if problem.views.is_empty() {
        return refused("no views");
    }
    for view in &problem.views {
        if view.target.len() != view.pixels.len() {
            return refused("points and pixels do not pair");
        }
        if view.target.len() < 4 {
            return refused("fewer than four points in a view");
        }
        if !view.target.iter().chain(&view.pixels).flatten().all(|v| v.is_finite()) {
            return refused("a coordinate was not measured");
        }
    }
    let points = || problem.views.iter().flat_map(|view| &view.target);
    let unit = (points().map(|p| dot(p, p)).sum::<f64>() / points().count() as f64).sqrt();
    let mut problem = problem.clone();
    problem.views.iter_mut().flat_map(|view| &mut view.target).flatten().for_each(|v| *v /= unit);
    Ok((problem, unit))
}

/// The state of least squares, and whether it is one: the descent ended by itself.
fn refined(problem: &Problem, mut state: State) -> Refusable<(State, bool)> {
    let mut r = residuals(&problem.views, &state);
    let mut damping = 1e-3;
    for _ in 0..100 {
        let (mut normal, gradient) = linearise(&problem.views, &state, &problem.free, &r);
        let scale = equilibrate(&mut normal)?;
        loop {
            if damping > 1e8 {
                return Ok((state, true)); // no step lowers the cost
            }
            let mut damped = normal.clone();
            (0..scale.len()).for_each(|i| damped[i][i] += damping);
            let downhill = gradient.iter().zip(&scale).map(|(g, s)| -g / s).collect();
            let next = cholesky(damped).ok().map(|l| {
                let step: Vector = solved(&l, downhill).iter().zip(&scale).map(|(v, s)| v / s).collect();
                let next = stepped(&state, &problem.free, &step);
                (residuals(&problem.views, &next), next)
            });
            let Some((after, next)) = next.filter(|(after, _)| dot(after, after) <= dot(&r, &r)) else {
                damping *= 10.0;
                continue;
            };
            let gain = dot(&r, &r) - dot(&after, &after);
            (state, r) = (next, after);
            damping = f64::max(damping / 10.0, 1e-15);
            if gain <= 1e-15 * dot(&r, &r) + 1e-24 {
                return Ok((state, true));
            }
            break;
        }
    }
    Ok((state, false))
}

fn solve(problem: &Problem) -> Refusable<Answer> {
    let (problem, unit) = checked(problem)?;
    let (mut state, converged) = refined(&problem, start(&problem)?)?;
    let r = residuals(&problem.views, &state);
    let (mut normal, _) = linearise(&problem.views, &state, &problem.free, &r);
    let scale = equilibrate(&mut normal)?;
    let inverted = inverse(&normal)?;
    let freedom = r.len() as f64 - scale.len() as f64;
    let condition = largest_eigenvalue(&inverted) * largest_eigenvalue(&normal);
    // A NaN is no good condition either.
    if freedom < 0.0 || !(condition <= 1e9) {
        return refused("the data do not determine the parameters");
    }
    let variance = dot(&r, &r) / freedom.max(1.0);
    let entry =
        |i: usize, k: usize| 0.5 * (inverted[i][k] + inverted[k][i]) / (scale[i] * scale[k]) * variance;
    let free = 0..problem.free.len();
    let covariance = free.clone().map(|i| free.clone().map(|k| entry(i, k)).collect()).collect();
    state.poses.iter_mut().flat_map(|pose| &mut pose.translation).for_each(|t| *t *= unit);
    let rmse = (2.0 * dot(&r, &r) / r.len() as f64).sqrt();
    Ok(Answer { converged, camera: state.camera, poses: state.poses, covariance, rmse })
}

// --- JSON --------------------------------------------------------------------------------------------

/// A value; `null` is NaN, a number that was not measured.
enum Json {
    Number(f64),
    Text(String),
    List(Vec<Json>),
    Fields(Vec<(String, Json)>),
}

impl Json {
    fn fields(&self) -> Refusable<&[(String, Json)]> {
        if let Json::Fields(fields) = self {
            Ok(fields)
        } else {
            refused("an object was expected")
        }
    }

    fn list(&self) -> Refusable<&[Json]> {
        if let Json::List(list) = self {
            Ok(list)
        } else {
            refused("a list was expected")
        }
    }

    fn text(&self) -> Refusable<&str> {
        if let Json::Text(text) = self {
            Ok(text)
        } else {
            refused("a text was expected")
        }
    }

    fn number(&self) -> Refusable<f64> {
        if let Json::Number(number) = self {
            Ok(*number)
        } else {
            refused("a number was expected")
        }
    }

    fn at(&self, name: &str) -> Refusable<&Json> {
        let found = self.fields()?.iter().find(|(field, _)| field == name);
        found.map(|(_, value)| value).ok_or(format!("the problem has no `{name}`"))
    }

    fn pair(&self) -> Refusable<[f64; 2]> {
        match self.list()? {
            [a, b] => Ok([a.number()?, b.number()?]),
            _ => refused("a pair of numbers was expected"),
        }
    }
}

/// What is left of a line.
struct Reader<'a>(&'a str);

impl<'a> Reader<'a> {
    fn takes(&mut self, wanted: &str) -> bool {
        self.0 = self.0.trim_start();
        let rest = self.0.strip_prefix(wanted);
        self.0 = rest.unwrap_or(self.0);
        rest.is_some()
    }

    fn needs(&mut self, wanted: &str) -> Refusable<()> {
        if self.takes(wanted) {
            Ok(())
        } else {
            Err(format!("`{wanted}` was expected"))
        }
    }

    /// Texts have no escapes in this protocol.
    fn text(&mut self) -> Refusable<String> {
        self.needs("\"")?;
        let (text, rest) = self.0.split_once('"').ok_or("the problem ends early")?;
        self.0 = rest;
        Ok(text.to_string())
    }

    /// What stands between commas up to the closing bracket.
    fn until<T>(&mut self, close: &str, one: impl Fn(&mut Self) -> Refusable<T>) -> Refusable<Vec<T>> {
        let mut all = Vec::new();
        while !self.takes(close) {
            if !all.is_empty() {
                self.needs(",")?;
            }
            all.push(one(self)?);
        }
        Ok(all)
    }

    fn value(&mut self) -> Refusable<Json> {
        if self.takes("{") {
            let field = |reader: &mut Self| {
                let name = reader.text()?;
                reader.needs(":")?;
                Ok((name, reader.value()?))
            };
            return Ok(Json::Fields(self.until("}", field)?));
        }
        if self.takes("[") {
            return Ok(Json::List(self.until("]", Self::value)?));
        }
        if self.takes("null") {
            return Ok(Json::Number(f64::NAN));
        }
        if self.0.starts_with('"') {
            return Ok(Json::Text(self.text()?));
        }
        let end = self.0.find([',', ']', '}', ' ']).unwrap_or(self.0.len());
        let (number, rest) = self.0.split_at(end);
        self.0 = rest;
        number.parse().map(Json::Number).map_err(|_| "a number was expected".to_string())
    }
}

fn place_of(name: &str) -> Refusable<usize> {
    NAMES.iter().position(|known| *known == name).ok_or(format!("no parameter is called `{name}`"))
}

fn problem_of(json: &Json) -> Refusable<Problem> {
    let points = |view: &Json, name| view.at(name)?.list()?.iter().map(Json::pair).collect::<Refusable<_>>();
    let view = |view: &Json| Ok(View { target: points(view, "target")?, pixels: points(view, "pixels")? });
    let held = |(name, value): &(String, Json)| Ok((place_of(name)?, value.number()?));
    Ok(Problem {
        image_size: json.at("image_size")?.pair()?,
        views: json.at("views")?.list()?.iter().map(view).collect::<Refusable<_>>()?,
        free: json.at("free")?.list()?.iter().map(|name| place_of(name.text()?)).collect::<Refusable<_>>()?,
        held: json.at("held")?.fields()?.iter().map(held).collect::<Refusable<_>>()?,
    })
}

fn listed(items: impl Iterator<Item = String>) -> String {
    items.collect::<Vec<_>>().join(",")
}

/// Rust writes the shortest decimal number that reads back as the same bits.
fn numbers(values: &[f64]) -> String {
    format!("[{}]", listed(values.iter().map(|value| format!("{value:e}"))))
}

fn answer_text(problem: &Problem, answer: &Answer) -> String {
    let status = if answer.converged { "ok" } else { "not_converged" };
    let free = || problem.free.iter();
    let values = listed(free().map(|i| format!("\"{}\":{:e}", NAMES[*i], answer.camera[*i])));
    let names = listed(free().map(|i| format!("\"{}\"", NAMES[*i])));
    let rows = listed(answer.covariance.iter().map(|row| numbers(row)));
    let poses = listed(answer.poses.iter().map(|pose| {
        let rotation = listed(pose.rotation.iter().map(|row| numbers(row)));
        format!("{{\"rotation\":[{rotation}],\"translation\":{}}}", numbers(&pose.translation))
    }));
    format!(
        "\"status\":\"{status}\",\"parameters\":{{{values}}},\"poses\":[{poses}],\
         \"covariance\":{{\"parameters\":[{names}],\"matrix\":[{rows}]}},\"rmse\":{:e}",
        answer.rmse
    )
}

fn answer(line: &str) -> String {
    let json = Reader(line).value();
    let id = json.as_ref().ok().and_then(|json| json.at("id").ok()?.text().ok()).unwrap_or("");
    let said = json.as_ref().map_err(String::clone).and_then(|json| {
        let problem = problem_of(json)?;
        Ok(answer_text(&problem, &solve(&problem)?))
    });
    let said = said
        .unwrap_or_else(|why| format!("\"status\":\"refused\",\"message\":\"{}\"", why.replace('"', "'")));
    format!("{{\"id\":\"{id}\",{said}}}")
}

fn main() -> std::io::Result<()> {
    for line in std::io::stdin().lock().lines() {
        let mut out = std::io::stdout().lock();
        writeln!(out, "{}", answer(&line?))?;
        out.flush()?;
    }
    Ok(())
}
