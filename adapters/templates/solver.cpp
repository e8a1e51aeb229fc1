// my-name: a complete calibrator for `calibench gate`, in C++17 and nothing else.
//
//     c++ -std=c++17 -O2 -o my-name my-name.cpp
//     calibench gate --solver ./my-name
//
// It reads problems, a JSON object a line, and writes answers, a JSON object a line. `main`, `answer` and the JSON at the end can stay;
// put your own calibrator in the place of `solve`. What it does now: homographies, a focal length from them, and Gauss-Newton with
// Levenberg's damping and numerical derivatives (Zhang 2000). It states its covariance, and refuses what it cannot solve.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

using Vector = std::vector<double>;
using Matrix = std::vector<Vector>;

// Why there is no answer; its text is told.
struct Refused : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// --- What is asked -----------------------------------------------------------------------------------------------------------

const std::array<std::string, 10> NAMES = {"fx", "fy", "cx", "cy", "skew", "k1", "k2", "p1", "p2", "k3"};

// The place of a parameter in NAMES.
int place(const std::string &name) {
    const auto found = std::find(NAMES.begin(), NAMES.end(), name);
    if (found == NAMES.end()) throw std::runtime_error("no parameter is called `" + name + "`");
    return static_cast<int>(found - NAMES.begin());
}
using Camera = std::array<double, 10>;

struct Point {
    double x, y;
};

struct View {
    std::vector<Point> target, pixels;
};

struct Problem {
    double width, height;
    std::vector<View> views;
    std::vector<int> free;  // places in NAMES
    std::map<std::string, double> held;
};

// X_camera = rotation X_target + translation.
struct Pose {
    std::array<std::array<double, 3>, 3> rotation;
    std::array<double, 3> translation;
};

struct Answer {
    bool converged;
    Camera camera;
    std::vector<Pose> poses;
    Matrix covariance;  // of the free parameters
    double rmse;
};

// --- Linear algebra ----------------------------------------------------------------------------------------------------------

// The lower factor L of a positive definite matrix, A = L L'.
Matrix cholesky(Matrix a) {
    const size_t n = a.size();
    for (size_t j = 0; j < n; ++j) {
        for (size_t k = 0; k < j; ++k)
            for (size_t i = j; i < n; ++i) a[i][j] -= a[i][k] * a[j][k];
        if (!(a[j][j] > 0)) throw Refused("the data do not determine the parameters");
        const double root = std::sqrt(a[j][j]);
        for (size_t i = j; i < n; ++i) a[i][j] /= root;
    }
    return a;
}

Vector solved(const Matrix &l, Vector b) {
    const int n = static_cast<int>(b.size());
    for (int i = 0; i < n; ++i) {
        for (int k = 0; k < i; ++k) b[i] -= l[i][k] * b[k];
        b[i] /= l[i][i];
    }
    for (int i = n - 1; i >= 0; --i) {
        for (int k = i + 1; k < n; ++k) b[i] -= l[k][i] * b[k];
        b[i] /= l[i][i];
    }
    return b;
}

Matrix inverse(const Matrix &a) {
    const size_t n = a.size();
    const Matrix l = cholesky(a);
    Matrix columns;
    for (size_t i = 0; i < n; ++i) {
        Vector unit(n, 0.0);
        unit[i] = 1.0;
        columns.push_back(solved(l, unit));
    }
    return columns;
}

// The largest eigenvalue of a symmetric matrix, by repeated multiplication: a few per cent are enough here.
double largest_eigenvalue(const Matrix &a) {
    const size_t n = a.size();
    Vector x(n);
    for (size_t i = 0; i < n; ++i) x[i] = 1.0 + 0.1 * static_cast<double>(i % 7);
    double length = 0;
    for (int step = 0; step < 50; ++step) {
        Vector y(n, 0.0);
        for (size_t i = 0; i < n; ++i)
            for (size_t k = 0; k < n; ++k) y[i] += a[i][k] * x[k];
        length = 0;
        for (double v : y) length += v * v;
        length = std::sqrt(length);
        for (size_t i = 0; i < n; ++i) x[i] = y[i] / length;
    }
    return length;
}

// Least squares of rows . x = right, by the normal equations.
Vector least_squares(const Matrix &rows, const Vector &right) {
    const size_t n = rows[0].size();
    Matrix normal(n, Vector(n, 0.0));
    Vector b(n, 0.0);
    for (size_t r = 0; r < rows.size(); ++r)
        for (size_t i = 0; i < n; ++i) {
            b[i] += rows[r][i] * right[r];
            for (size_t k = 0; k < n; ++k) normal[i][k] += rows[r][i] * rows[r][k];
        }
    return solved(cholesky(normal), b);
}

// --- The camera --------------------------------------------------------------------------------------------------------------

// exp(w) applied to a rotation on the left (Rodrigues).
Pose moved(const Pose &pose, const double *step) {
    const double angle = std::sqrt(step[0] * step[0] + step[1] * step[1] + step[2] * step[2]);
    const double s = angle < 1e-9 ? 1.0 : std::sin(angle) / angle;
    const double c = angle < 1e-9 ? 0.5 : (1 - std::cos(angle)) / (angle * angle);
    Pose next = pose;
    const std::array<std::array<double, 3>, 3> cross = {{{0, -step[2], step[1]}, {step[2], 0, -step[0]}, {-step[1], step[0], 0}}};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            double turned = pose.rotation[i][j];
            for (int k = 0; k < 3; ++k) {
                double square = 0;
                for (int m = 0; m < 3; ++m) square += cross[i][m] * cross[m][k];
                turned += (s * cross[i][k] + c * square) * pose.rotation[k][j];
            }
            next.rotation[i][j] = turned;
        }
    for (int i = 0; i < 3; ++i) next.translation[i] += step[3 + i];
    return next;
}

Point project(const Camera &camera, const Pose &pose, const Point &at) {
    const auto &[fx, fy, cx, cy, skew, k1, k2, p1, p2, k3] = camera;
    std::array<double, 3> p = pose.translation;
    for (int i = 0; i < 3; ++i) p[i] += pose.rotation[i][0] * at.x + pose.rotation[i][1] * at.y;
    const double x = p[0] / p[2], y = p[1] / p[2], s = x * x + y * y;
    const double g = 1 + s * (k1 + s * (k2 + s * k3));
    const double xd = x * g + 2 * p1 * x * y + p2 * (s + 2 * x * x);
    const double yd = y * g + p1 * (s + 2 * y * y) + 2 * p2 * x * y;
    return {fx * xd + skew * yd + cx, fy * yd + cy};
}

// --- The start ---------------------------------------------------------------------------------------------------------------

// From the target's plane to pixels relative to (cx, cy), by the direct linear transform with both sides about their middle.
Matrix homography(const View &view, double cx, double cy) {
    const auto normaliser = [](const std::vector<Point> &points) {
        double x = 0, y = 0, size = 0;
        for (const Point &p : points) x += p.x / points.size(), y += p.y / points.size();
        for (const Point &p : points) size += std::hypot(p.x - x, p.y - y) / points.size();
        if (!(size > 0)) throw Refused("all points of a view are one");
        return std::array<double, 3>{x, y, std::sqrt(2.0) / size};
    };
    const auto t = normaliser(view.target), u = normaliser(view.pixels);
    Matrix rows;
    Vector right;
    for (size_t i = 0; i < view.target.size(); ++i) {
        const double x = t[2] * (view.target[i].x - t[0]), y = t[2] * (view.target[i].y - t[1]);
        const double a = u[2] * (view.pixels[i].x - u[0]), b = u[2] * (view.pixels[i].y - u[1]);
        rows.push_back({x, y, 1, 0, 0, 0, -a * x, -a * y});
        rows.push_back({0, 0, 0, x, y, 1, -b * x, -b * y});
        right.push_back(a);
        right.push_back(b);
    }
    const Vector h = least_squares(rows, right);
    Matrix result(3, Vector(3));
    const Matrix raw = {{h[0], h[1], h[2]}, {h[3], h[4], h[5]}, {h[6], h[7], 1}};
    for (int j = 0; j < 3; ++j) {
        Vector column(3);
        for (int i = 0; i < 3; ++i) {
            // The target's side: x = t2 (X - t0).
            column[i] = j < 2 ? t[2] * raw[i][j] : raw[i][2] - t[2] * (t[0] * raw[i][0] + t[1] * raw[i][1]);
        }
        result[0][j] = column[0] / u[2] + (u[0] - cx) * column[2];
        result[1][j] = column[1] / u[2] + (u[1] - cy) * column[2];
        result[2][j] = column[2];
    }
    double norm = 0;
    for (const Vector &row : result)
        for (double v : row) norm += v * v;
    for (Vector &row : result)
        for (double &v : row) v /= std::sqrt(norm);
    return result;
}

// The pose behind a homography: two columns of the rotation, the translation, in front of the camera.
Pose pose_of(const Matrix &h, double fx, double fy) {
    std::array<std::array<double, 3>, 3> m;
    for (int j = 0; j < 3; ++j) m[j] = {h[0][j] / fx, h[1][j] / fy, h[2][j]};
    const auto length = [](const std::array<double, 3> &v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); };
    const double scale = (m[2][2] < 0 ? -2 : 2) / (length(m[0]) + length(m[1]));
    for (auto &column : m)
        for (double &v : column) v *= scale;
    auto a = m[0], b = m[1];
    const double norm_a = length(a);
    for (double &v : a) v /= norm_a;
    const double along = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    for (int i = 0; i < 3; ++i) b[i] -= along * a[i];
    const double norm_b = length(b);
    for (double &v : b) v /= norm_b;
    const std::array<double, 3> c = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    Pose pose;
    for (int i = 0; i < 3; ++i) pose.rotation[i] = {a[i], b[i], c[i]};
    pose.translation = m[2];
    return pose;
}

// The focal lengths with the principal point in the image's middle: columns of K^-1 H are perpendicular and equally long.
void start(const Problem &problem, Camera &camera, std::vector<Pose> &poses) {
    camera.fill(0.0);
    camera[2] = (problem.width - 1) / 2;
    camera[3] = (problem.height - 1) / 2;
    for (const auto &[name, value] : problem.held)
        camera[place(name)] = value;
    std::vector<Matrix> homographies;
    Matrix rows;
    Vector right;
    for (const View &view : problem.views) {
        homographies.push_back(homography(view, camera[2], camera[3]));
        const Matrix &h = homographies.back();
        rows.push_back({h[0][0] * h[0][1], h[1][0] * h[1][1]});
        right.push_back(-h[2][0] * h[2][1]);
        rows.push_back({h[0][0] * h[0][0] - h[0][1] * h[0][1], h[1][0] * h[1][0] - h[1][1] * h[1][1]});
        right.push_back(h[2][1] * h[2][1] - h[2][0] * h[2][0]);
    }
    Vector inverse_squares(2, 0.0);
    try {
        inverse_squares = least_squares(rows, right);
    } catch (const Refused &) {
        // Parallel planes: any focal length will do to begin with.
    }
    for (int i = 0; i < 2; ++i)
        if (!problem.held.count(NAMES[i]))
            camera[i] = inverse_squares[i] > 0 ? 1 / std::sqrt(inverse_squares[i]) : problem.width;
    for (const Matrix &h : homographies) poses.push_back(pose_of(h, camera[0], camera[1]));
}

// --- The refinement ----------------------------------------------------------------------------------------------------------

struct State {
    Camera camera;
    std::vector<Pose> poses;
};

State stepped(const State &state, const std::vector<int> &free, const Vector &step) {
    State next = state;
    for (size_t i = 0; i < free.size(); ++i) next.camera[free[i]] += step[i];
    for (size_t v = 0; v < next.poses.size(); ++v) next.poses[v] = moved(next.poses[v], &step[free.size() + 6 * v]);
    return next;
}

Vector residuals(const std::vector<View> &views, const State &state) {
    Vector r;
    for (size_t v = 0; v < views.size(); ++v)
        for (size_t i = 0; i < views[v].target.size(); ++i) {
            const Point p = project(state.camera, state.poses[v], views[v].target[i]);
            r.push_back(p.x - views[v].pixels[i].x);
            r.push_back(p.y - views[v].pixels[i].y);
        }
    return r;
}

double squared(const Vector &r) {
    double sum = 0;
    for (double v : r) sum += v * v;
    return sum;
}

// Normal equations by central differences; a pose moves the pixels of its own view only.
void linearise(const std::vector<View> &views, const State &state, const std::vector<int> &free, const Vector &r, Matrix &normal,
               Vector &gradient) {
    const size_t count = free.size(), n = count + 6 * views.size();
    normal.assign(n, Vector(n, 0.0));
    gradient.assign(n, 0.0);
    size_t row = 0;
    for (size_t v = 0; v < views.size(); ++v) {
        std::vector<size_t> places(count);
        for (size_t i = 0; i < count; ++i) places[i] = i;
        for (size_t i = 0; i < 6; ++i) places.push_back(count + 6 * v + i);
        std::vector<Camera> cameras[2];
        std::vector<Pose> poses[2];
        Vector widths;
        for (size_t k = 0; k < places.size(); ++k) {
            const double h = 1e-6 * (k < count ? std::max(1.0, std::fabs(state.camera[free[k]])) : 1.0);
            widths.push_back(2 * h);
            for (int side = 0; side < 2; ++side) {
                Camera camera = state.camera;
                double step[6] = {};
                (k < count ? camera[free[k]] : step[k - count]) += side == 0 ? h : -h;
                cameras[side].push_back(camera);
                poses[side].push_back(moved(state.poses[v], step));
            }
        }
        for (const Point &at : views[v].target) {
            Vector du, dv;
            for (size_t k = 0; k < places.size(); ++k) {
                const Point up = project(cameras[0][k], poses[0][k], at), down = project(cameras[1][k], poses[1][k], at);
                du.push_back((up.x - down.x) / widths[k]);
                dv.push_back((up.y - down.y) / widths[k]);
            }
            for (size_t i = 0; i < places.size(); ++i) {
                gradient[places[i]] += du[i] * r[row] + dv[i] * r[row + 1];
                for (size_t k = 0; k < places.size(); ++k) normal[places[i]][places[k]] += du[i] * du[k] + dv[i] * dv[k];
            }
            row += 2;
        }
    }
}

// Divides rows and columns by the roots of the diagonal, so that units do not matter.
Vector equilibrate(Matrix &normal) {
    Vector scale;
    for (size_t i = 0; i < normal.size(); ++i) {
        if (!(normal[i][i] > 0)) throw Refused("a parameter has no influence");
        scale.push_back(std::sqrt(normal[i][i]));
    }
    for (size_t i = 0; i < normal.size(); ++i)
        for (size_t k = 0; k < normal.size(); ++k) normal[i][k] /= scale[i] * scale[k];
    return scale;
}

Answer solve(const Problem &asked) {
    if (asked.views.empty()) throw Refused("no views");
    Problem problem = asked;
    double square = 0, points = 0;
    for (const View &view : problem.views) {
        if (view.target.size() != view.pixels.size()) throw Refused("points and pixels do not pair");
        if (view.target.size() < 4) throw Refused("fewer than four points in a view");
        for (size_t i = 0; i < view.target.size(); ++i) {
            const Point t = view.target[i], p = view.pixels[i];
            if (!std::isfinite(t.x + t.y + p.x + p.y)) throw Refused("a coordinate was not measured");
            square += t.x * t.x + t.y * t.y;
        }
        points += static_cast<double>(view.target.size());
    }
    // A target of unit size makes rotations and translations alike.
    const double unit = std::sqrt(square / points);
    for (View &view : problem.views)
        for (Point &p : view.target) p = {p.x / unit, p.y / unit};
    State state;
    start(problem, state.camera, state.poses);
    Vector r = residuals(problem.views, state), gradient, scale;
    Matrix normal;
    double damping = 1e-3;
    bool converged = false;
    for (int iteration = 0; iteration < 100 && !converged; ++iteration) {
        linearise(problem.views, state, problem.free, r, normal, gradient);
        scale = equilibrate(normal);
        for (;; damping *= 10) {
            if (damping > 1e8) {
                converged = true;  // no step lowers the cost
                break;
            }
            Matrix damped = normal;
            Vector step(gradient.size());
            for (size_t i = 0; i < step.size(); ++i) damped[i][i] += damping, step[i] = -gradient[i] / scale[i];
            try {
                step = solved(cholesky(damped), step);
            } catch (const Refused &) {
                continue;
            }
            for (size_t i = 0; i < step.size(); ++i) step[i] /= scale[i];
            const State next = stepped(state, problem.free, step);
            const Vector after = residuals(problem.views, next);
            if (!(squared(after) <= squared(r))) continue;
            const double gain = squared(r) - squared(after);
            state = next;
            r = after;
            damping = std::max(damping / 10, 1e-15);
            converged = gain <= 1e-15 * squared(r) + 1e-24;
            break;
        }
    }
    linearise(problem.views, state, problem.free, r, normal, gradient);
    scale = equilibrate(normal);
    const Matrix inverted = inverse(normal);
    const double freedom = static_cast<double>(r.size()) - static_cast<double>(scale.size());
    if (freedom < 0 || largest_eigenvalue(inverted) * largest_eigenvalue(normal) > 1e9)
        throw Refused("the data do not determine the parameters");
    const double variance = squared(r) / std::max(freedom, 1.0);
    Answer answer{converged, state.camera, state.poses, {}, std::sqrt(squared(r) / (static_cast<double>(r.size()) / 2))};
    for (size_t i = 0; i < problem.free.size(); ++i) {
        answer.covariance.emplace_back();
        for (size_t k = 0; k < problem.free.size(); ++k)
            answer.covariance[i].push_back(0.5 * (inverted[i][k] + inverted[k][i]) / (scale[i] * scale[k]) * variance);
    }
    for (Pose &pose : answer.poses)
        for (double &t : pose.translation) t *= unit;
    return answer;
}

// --- JSON --------------------------------------------------------------------------------------------------------------------

// A value; `null` is a number that was not measured.
struct Json {
    double number = NAN;
    std::string text;
    std::vector<Json> list;
    std::map<std::string, Json> fields;

    const Json &at(const std::string &name) const {
        const auto found = fields.find(name);
        if (found == fields.end()) throw Refused("the problem has no `" + name + "`");
        return found->second;
    }
};

struct Reader {
    const std::string &line;
    size_t place = 0;

    char next() {
        while (place < line.size() && std::isspace(static_cast<unsigned char>(line[place]))) ++place;
        if (place == line.size()) throw Refused("the problem ends early");
        return line[place];
    }

    bool takes(char wanted) {
        if (next() != wanted) return false;
        ++place;
        return true;
    }

    // Names have no escapes in this protocol.
    std::string text() {
        if (!takes('"')) throw Refused("a name was expected");
        const size_t end = line.find('"', place);
        if (end == std::string::npos) throw Refused("the problem ends early");
        const std::string result = line.substr(place, end - place);
        place = end + 1;
        return result;
    }

    Json value() {
        Json json;
        const char first = next();
        if (first == '{') {
            ++place;
            while (!takes('}')) {
                const std::string name = text();
                if (!takes(':')) throw Refused("`:` was expected");
                json.fields[name] = value();
                takes(',');
            }
        } else if (first == '[') {
            ++place;
            while (!takes(']')) {
                json.list.push_back(value());
                takes(',');
            }
        } else if (first == '"') {
            json.text = text();
        } else if (line.compare(place, 4, "null") == 0) {
            place += 4;
        } else {
            char *end = nullptr;
            json.number = std::strtod(line.c_str() + place, &end);
            if (end == line.c_str() + place) throw Refused("a number was expected");
            place = end - line.c_str();
        }
        return json;
    }
};

std::vector<Point> points_of(const Json &list) {
    std::vector<Point> points;
    for (const Json &pair : list.list) {
        if (pair.list.size() != 2) throw Refused("a point is no pair");
        points.push_back({pair.list[0].number, pair.list[1].number});
    }
    return points;
}

Problem problem_of(const Json &json) {
    Problem problem{json.at("image_size").list.at(0).number, json.at("image_size").list.at(1).number, {}, {}, {}};
    for (const Json &view : json.at("views").list)
        problem.views.push_back({points_of(view.at("target")), points_of(view.at("pixels"))});
    for (const Json &name : json.at("free").list)
        problem.free.push_back(place(name.text));
    for (const auto &[name, value] : json.at("held").fields) problem.held[name] = value.number;
    return problem;
}

std::string number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.17g", value);
    return text;
}

template <typename List>
std::string listed(const List &list) {
    std::string text = "[";
    for (double value : list) text += (text.size() > 1 ? "," : "") + number(value);
    return text + "]";
}

std::string answer_text(const Problem &problem, const Answer &answer) {
    std::string values, names, poses, rows;
    const auto comma = [](std::string &text) { text += text.empty() ? "" : ","; };
    for (size_t i = 0; i < problem.free.size(); ++i) {
        const std::string name = "\"" + NAMES[problem.free[i]] + "\"";
        comma(values), comma(names), comma(rows);
        values += name + ":" + number(answer.camera[problem.free[i]]);
        names += name;
        rows += listed(answer.covariance[i]);
    }
    for (const Pose &pose : answer.poses) {
        comma(poses);
        poses += "{\"rotation\":[" + listed(pose.rotation[0]) + "," + listed(pose.rotation[1]) + "," + listed(pose.rotation[2]) +
                 "],\"translation\":" + listed(pose.translation) + "}";
    }
    return "\"status\":\"" + std::string(answer.converged ? "ok" : "not_converged") + "\",\"parameters\":{" + values + "},\"poses\":[" +
           poses + "],\"covariance\":{\"parameters\":[" + names + "],\"matrix\":[" + rows + "]},\"rmse\":" + number(answer.rmse);
}

std::string answer(const std::string &line) {
    std::string id = "\"\"";
    try {
        const Json json = Reader{line}.value();
        id = "\"" + json.at("id").text + "\"";
        const Problem problem = problem_of(json);
        return "{\"id\":" + id + "," + answer_text(problem, solve(problem)) + "}";
    } catch (const std::exception &error) {
        return "{\"id\":" + id + ",\"status\":\"refused\",\"message\":\"" + error.what() + "\"}";
    }
}

int main() {
    std::string line;
    while (std::getline(std::cin, line)) std::cout << answer(line) << std::endl;
}
