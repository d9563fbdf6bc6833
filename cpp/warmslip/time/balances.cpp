#include "warmslip/time/balances.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "warmslip/fem/supports.hpp"

namespace warmslip {

template <int d>
BalanceEvaluator<d>::BalanceEvaluator(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators,
                                      const ContactSurface<d>& surface, const BalanceEvaluator* like)
    : layout_(layout),
      problem_(problem),
      operators_(operators),
      surface_(surface),
      unknowns_(surface.unknowns(d)),
      nodes_(surface.global_nodes()) {
  using Self = BalanceEvaluator;
  for (const auto& [a, rows] :
       {std::pair{Mat(operators.elasticity), &Self::elastic_rows_},
        std::pair{Mat(operators.viscosity), &Self::viscous_rows_},
        std::pair{Mat(operators.expansion), &Self::expansion_rows_}, std::pair{Mat(operators.mass), &Self::mass_rows_},
        std::pair{Mat(operators.conductivity), &Self::conduction_rows_},
        std::pair{Mat(operators.exchange), &Self::exchange_rows_},
        std::pair{Mat(operators.heating), &Self::heating_rows_}})
    this->*rows = like ? like->*rows : row_sizes(a);
  spring_rows_ = like ? like->spring_rows_ : all_row_sizes(operators.springs);
  dashpot_rows_ = like ? like->dashpot_rows_ : all_row_sizes(operators.dashpots);
  if (like) {
    inertia_rows_ = like->inertia_rows_;
  } else if (operators.inertia) {  // its entries are positive
    const VecHandle sums = row_sums(operators.inertia);
    inertia_rows_ = (*Values(sums)).reshaped(d, layout.owned()).colwise().maxCoeff().transpose();
  }
  if (operators.viscosity) viscous_w_ = layout.vector(d);
  if (surface.points() > 0) contact_force_ = layout.vector(d);
  if (problem.moves()) reactions_ = layout.vector(d);
  if (operators.springs) springs_ = layout.vector(d);
  if (operators.dashpots) dashpots_ = layout.vector(d);
  if (operators.dashpots) rigid_w_ = layout.vector(d);
  if (operators.conductivity) conducted_ = layout.vector(1);
  if (operators.conductivity) support_heat_ = layout.vector(1);
  if (operators.exchange) exchanged_ = layout.vector(1);
  if (operators.conductivity && problem.contact_heats()) {
    contact_heat_ = layout.vector(1);
    contact_heat_size_ = layout.vector(1);
  }
  centroid_ = layout.mesh().nodes.colwise().mean().transpose();
  const PetscInt first = layout.owned() ? layout.global_nodes()[0] : 0;
  for (PetscInt& i : unknowns_) i -= first * d;
  for (PetscInt& i : nodes_) i -= first;
  support_.assign(static_cast<std::size_t>(layout.owned()), -1);
  temperature_prescribed_.resize(support_.size());
  for (const auto& [node, held] : held_directions(problem)) {
    if (!owns(layout, node)) continue;
    support_[static_cast<std::size_t>(layout.global_of(node) - first)] = static_cast<int>(held_.size());
    held_.push_back(held);
  }
  for (const PetscInt i : operators.prescribed_temperature)
    temperature_prescribed_[static_cast<std::size_t>(i - first)] = true;
  for (const auto& [rows, size] :
       {std::pair{&heating_rows_, &heating_}, std::pair{&mass_rows_, &mass_},
        std::pair{&conduction_rows_, &conduction_}, std::pair{&exchange_rows_, &exchange_}}) {
    size->sum = layout.sum(rows->size() ? rows->sum() : 0.0);
    size->largest = over_ranks(layout.comm(), std::array{rows->size() ? rows->maxCoeff() : 0.0})[0];
  }
  any_temperature_prescribed_ = layout.sum(static_cast<double>(operators.prescribed_temperature.size())) > 0;
  double stiffest = elastic_rows_.size() ? elastic_rows_.maxCoeff() : 0;
  MPI_Allreduce(&stiffest, &stiffest_, 1, MPI_DOUBLE, MPI_MAX, layout.comm());
  const double length = (layout.mesh().nodes.colwise().maxCoeff() - layout.mesh().nodes.colwise().minCoeff()).norm();
  for (const Material<d>& material : problem.materials) {
    reference_ = std::max(reference_, std::abs(material.reference));
    if (!material.elasticity || !material.expansion) continue;
    const Mandel<d> strain = material.elasticity->colPivHouseholderQr().solve(to_mandel<d>(*material.expansion));
    free_expansion_ = std::max(free_expansion_, length * strain.norm());
  }
  heat_magnitudes_ = heat_external_ = Eigen::VectorXd::Zero(layout.owned());
  force_magnitudes_ = force_external_ = Eigen::VectorXd::Zero(layout.owned() * d);
  if (like)
    shape_ = like->shape_;
  else
    find_shape_functions();
}

template <int d>
Balances BalanceEvaluator<d>::evaluate(const TimeLevel& before, const TimeLevel& after, const StepInputs& in) {
  if (after.w) multiply(operators_.viscosity, after.straining(), viscous_w_);
  if (springs_) multiply(operators_.springs, sprung_ ? Vec(after.u) : after.shape(), springs_);
  if (dashpots_) multiply(operators_.dashpots, sprung_ ? Vec(after.w) : after.straining(), dashpots_);
  if (dashpots_ && sprung_) {
    WARMSLIP_PETSC(VecWAXPY(rigid_w_, -1, after.strained_w, after.w));
    WARMSLIP_PETSC(MatMultAdd(operators_.dashpots, rigid_w_, viscous_w_, viscous_w_));
  }
  multiply(operators_.conductivity, after.theta, conducted_);
  multiply(operators_.exchange, after.theta, exchanged_);
  return terms(before, after, in);
}

template <int d>
void BalanceEvaluator<d>::store_magnitudes(const TimeLevel& before, const TimeLevel& after, const StepInputs& in) {
  stores_magnitudes_ = true;
  terms(before, after, in);
  stores_magnitudes_ = false;
}

template <int d>
Balances BalanceEvaluator<d>::terms(const TimeLevel& before, const TimeLevel& after, const StepInputs& in) {
  Balances balances{};
  work_magnitude_ = 0;
  if (surface_.points() > 0) contact(before, after, in, balances);
  if (after.w) {
    forces(before, after, in, balances);
    energy(before, after, in, balances);
  }
  if (after.theta) heat(before, after, in, balances);
  return balances;
}

template class BalanceEvaluator<2>;
template class BalanceEvaluator<3>;

}  // namespace warmslip
