// Which of the many equal answers: contact points that outnumber the contact nodes share the force of a node.
#pragma once
#include <Eigen/Sparse>

#include "warmslip/contact/problem.hpp"

namespace warmslip {

/// Gives the points at rest, all those that slip no faster than the law's tolerance can tell, the friction that is
/// least, sum |lambda|^2 / weight, among that which puts the same force on every node that moves and keeps the friction
/// law; on a rigid foundation, which gives no pressure by its penetration, the pressure as well, also that of points
/// which slip with a friction that does not follow it. They are unique, whereas Newton's depend on its path. Rest is
/// called stick. `shape` (d points, d nodes) has the motion of the points from that of those nodes, as supports let
/// them move. Velocities stay. Returns whether least forces were found; the ones that were there, which obey the law as
/// well, stay otherwise.
template <int d>
bool minimal_forces(const ContactProblem<d>& problem, const Eigen::SparseMatrix<double, Eigen::RowMajor>& shape,
                    double tolerance, ContactSolution<d>& solution);

}  // namespace warmslip
