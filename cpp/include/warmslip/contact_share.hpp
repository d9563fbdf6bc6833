// Which of the many equal answers: contact points that outnumber the contact nodes share the force of a sticking node.
#pragma once
#include <Eigen/Sparse>

#include "warmslip/contact_solver.hpp"

namespace warmslip {

/// Gives the points at rest, all those that slip no faster than the law's tolerance can tell, the tangential forces
/// that are least, sum |lambda_tau|^2 / weight, among those that put the same force on every node that moves and keep
/// the friction law. They are unique, whereas Newton's depend on its path. Rest is called stick. `shape` (points,
/// nodes) has those nodes' shape functions at the points. Velocities and normal forces stay. Returns whether least
/// forces were found; the ones that were there, which obey the law as well, stay otherwise.
template <int d>
bool share_least(const ContactProblem<d>& problem, const Eigen::SparseMatrix<double, Eigen::RowMajor>& shape,
                 double tolerance, ContactSolution<d>& solution);

}  // namespace warmslip
