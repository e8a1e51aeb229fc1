// Ceres' side of the comparison: the refinement alone, from the closed form that it is given, poses eliminated (Schur).
//
//     c++ -O3 -march=native -I/usr/include/eigen3 ceres_peer.cpp -lceres -lglog
#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

using Numbers = std::vector<double>;

static Numbers read(const std::string &path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    Numbers numbers(static_cast<size_t>(file.tellg()) / sizeof(double));
    file.seekg(0);
    file.read(reinterpret_cast<char *>(numbers.data()), static_cast<std::streamsize>(numbers.size() * sizeof(double)));
    return numbers;
}

// Predicted minus observed pixel; derivatives by dual numbers.
struct Residual {
    const double *pair; // X, Y, u, v

    template <typename T> bool operator()(const T *camera, const T *pose, T *residual) const {
        const T target[3] = {T(pair[0]), T(pair[1]), T(0.0)};
        T point[3];
        ceres::AngleAxisRotatePoint(pose, target, point);
        const T x = (point[0] + pose[3]) / (point[2] + pose[5]);
        const T y = (point[1] + pose[4]) / (point[2] + pose[5]);
        const T s = x * x + y * y;
        const T g = 1.0 + s * (camera[4] + s * camera[5]);
        residual[0] = camera[0] * x * g + camera[2] - pair[2];
        residual[1] = camera[1] * y * g + camera[3] - pair[3];
        return true;
    }
};

struct Work {
    Numbers pairs, start;
    double camera[6];
    Numbers poses;
    ceres::Problem problem;
    ceres::Solver::Options options;

    Work(const std::string &folder, const std::string &count)
        : pairs(read(folder + "/views-" + count)), start(read(folder + "/start-" + count)) {
        const size_t views = std::stoul(count), points = pairs.size() / 4 / views;
        poses.resize(6 * views);
        auto *ordering = new ceres::ParameterBlockOrdering;
        for (size_t i = 0; i < views; ++i) {
            for (size_t j = 0; j < points; ++j) {
                auto *cost = new ceres::AutoDiffCostFunction<Residual, 2, 6, 6>(new Residual{&pairs[4 * (i * points + j)]});
                problem.AddResidualBlock(cost, nullptr, camera, &poses[6 * i]);
            }
            ordering->AddElementToGroup(&poses[6 * i], 0);
        }
        ordering->AddElementToGroup(camera, 1);
        options.linear_solver_ordering.reset(ordering);
        options.linear_solver_type = ceres::DENSE_SCHUR;
        options.num_threads = 1;
        options.max_num_iterations = 100;
        options.function_tolerance = 1e-10;
        options.logging_type = ceres::SILENT;
    }

    void run() {
        std::copy_n(start.begin(), 6, camera);
        for (size_t i = 0; i < poses.size() / 6; ++i) {
            const double *at = &start[6 + 12 * i];
            ceres::RotationMatrixToAngleAxis(ceres::RowMajorAdapter3x3(at), &poses[6 * i]);
            std::copy_n(at + 9, 3, &poses[6 * i + 3]);
        }
        ceres::Solver::Summary summary;
        ceres::Solve(options, &problem, &summary);
        if (summary.termination_type != ceres::CONVERGENCE) std::cerr << summary.message << "\n";
    }
};

static double seconds(Work &work, double budget) {
    using Clock = std::chrono::steady_clock;
    const auto since = [](Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); };
    Numbers times;
    const auto start = Clock::now();
    while (times.empty() || since(start) < budget) {
        const auto one = Clock::now();
        work.run();
        times.push_back(since(one));
    }
    std::sort(times.begin(), times.end());
    return times[times.size() / 2];
}

int main(int, char **arguments) {
    const std::string folder = arguments[1];
    std::map<std::string, Work *> works;
    for (std::string line; std::getline(std::cin, line);) {
        std::istringstream words(line);
        std::string request, row, argument;
        words >> request >> row >> argument;
        Work *&work = works[row];
        if (!work) work = new Work(folder, row.substr(row.find('-') + 1));
        if (request == "time") {
            std::cout << seconds(*work, std::stod(argument)) << std::endl;
        } else {
            work->run();
            std::ofstream(argument, std::ios::binary).write(reinterpret_cast<char *>(work->camera), sizeof work->camera);
            std::cout << "done" << std::endl;
        }
    }
}
