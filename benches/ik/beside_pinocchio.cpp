// Damped least squares with restarts on pinocchio, in C++: the yardstick of `beside_pinocchio.py`, which
// compiles and calls it. Reads a model that `saveToText` wrote and poses (x y z qx qy qz qw, one a line), prints one JSON object.
//
// pinocchio MODEL TIP POSES RESTARTS STEPS DAMPING STEP_LENGTH TOLERANCE_M TOLERANCE_RAD
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/serialization.hpp>
#include <pinocchio/spatial.hpp>

#include <ctime>
#include <fstream>
#include <iostream>
#include <random>

namespace pin = pinocchio;

struct Options {
    int restarts, steps;
    double damping, step_length, tolerance_m, tolerance_rad;
};

// Joint values inside the limits; joints without limits have two numbers, which stay as they are.
static void clamp(const pin::Model& model, Eigen::VectorXd& q) {
    for (pin::JointIndex j = 1; j < pin::JointIndex(model.njoints); ++j) {
        if (model.nqs[j] != model.nvs[j]) continue;
        const int i = model.idx_qs[j];
        q[i] = std::min(std::max(q[i], model.lowerPositionLimit[i]), model.upperPositionLimit[i]);
    }
}

static Eigen::VectorXd random_posture(const pin::Model& model, std::mt19937_64& generator) {
    std::uniform_real_distribution<double> part(0.0, 1.0);
    Eigen::VectorXd q = pin::neutral(model);
    for (pin::JointIndex j = 1; j < pin::JointIndex(model.njoints); ++j) {
        const int i = model.idx_qs[j];
        if (model.nqs[j] == model.nvs[j]) {
            const double lower = model.lowerPositionLimit[i], upper = model.upperPositionLimit[i];
            q[i] = lower + part(generator) * (upper - lower);
        } else {
            const double angle = (2.0 * part(generator) - 1.0) * M_PI;
            q[i] = std::cos(angle);
            q[i + 1] = std::sin(angle);
        }
    }
    return q;
}

// Steps from one start; whether the target was reached. Counts the steps.
static bool descend(const pin::Model& model, pin::Data& data, pin::FrameIndex tip, const pin::SE3& target,
                    const Options& o, Eigen::VectorXd& q, long& steps) {
    pin::Data::Matrix6x J(6, model.nv);
    for (int k = 0; k <= o.steps; ++k) {
        pin::forwardKinematics(model, data, q);
        const pin::SE3& at = pin::updateFramePlacement(model, data, tip);
        const pin::SE3 error = at.actInv(target);
        const double off_m = (target.translation() - at.translation()).norm();
        if (off_m <= o.tolerance_m && pin::log3(error.rotation()).norm() <= o.tolerance_rad) return true;
        if (k == o.steps) break;
        ++steps;
        J.setZero();
        pin::computeFrameJacobian(model, data, q, tip, pin::LOCAL, J);
        pin::Data::Matrix6 Jlog;
        pin::Jlog6(error.inverse(), Jlog);
        J = -Jlog * J;
        pin::Data::Matrix6 JJt = J * J.transpose();
        JJt.diagonal().array() += o.damping;
        const Eigen::VectorXd v = -J.transpose() * JJt.ldlt().solve(pin::log6(error).toVector());
        q = pin::integrate(model, q, v * o.step_length);
        clamp(model, q);
    }
    return false;
}

int main(int argc, char** argv) {
    if (argc != 10) return 2;
    const Options o{std::stoi(argv[4]), std::stoi(argv[5]), std::stod(argv[6]),
                    std::stod(argv[7]), std::stod(argv[8]), std::stod(argv[9])};
    pin::Model model;
    model.loadFromText(argv[1]);
    pin::Data data(model);
    const pin::FrameIndex tip = model.getFrameId(argv[2]);
    std::vector<pin::SE3> targets;
    std::ifstream poses(argv[3]);
    double x, y, z, qx, qy, qz, qw;
    while (poses >> x >> y >> z >> qx >> qy >> qz >> qw)
        targets.emplace_back(Eigen::Quaterniond(qw, qx, qy, qz).normalized(), Eigen::Vector3d(x, y, z));
    std::mt19937_64 generator(7);
    long steps = 0, starts = 0, solved = 0;
    const std::clock_t begun = std::clock();
    for (const pin::SE3& target : targets) {
        Eigen::VectorXd q = pin::neutral(model);
        clamp(model, q);
        for (int k = 0; k <= o.restarts; ++k) {
            if (k > 0) q = random_posture(model, generator);
            ++starts;
            if (descend(model, data, tip, target, o, q, steps)) {
                ++solved;
                break;
            }
        }
    }
    const double us = 1e6 * double(std::clock() - begun) / CLOCKS_PER_SEC, n = double(targets.size());
    std::cout << "{\"solved\": " << solved << ", \"us\": " << us / n << ", \"steps\": " << steps / n
              << ", \"starts\": " << starts / n << "}\n";
}
