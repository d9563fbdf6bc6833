// How well forces and velocities obey the contact law.
#pragma once
#include "warmslip/contact/problem.hpp"

namespace warmslip {

/// Backward error of (force, velocity) in the contact law: the largest relative change of the normal forces, of the
/// terms of the penetrations, of the friction bounds and of the slip velocities after which the law holds exactly.
/// Forces are measured by the largest of them, the penetration of a point by its gap and by the largest components
/// along its normal of |u| + k (|w| + |free|) over all points. A stiff foundation is so judged by the penetration and a
/// soft one by the force. Displacements count as no smaller than `least`, component by component. Infinite when a
/// number overflowed.
template <int d>
double law_residual(const ContactProblem<d>& problem, const Eigen::VectorXd& force, const Eigen::VectorXd& velocity,
                    const Point<d>& least = Point<d>::Zero());

}  // namespace warmslip
