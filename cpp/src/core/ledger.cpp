#include "warmslip/ledger.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <map>

#include "warmslip/contact_solver.hpp"

namespace warmslip {
namespace {

double dot(Vec a, Vec b) {
  PetscReal value = 0;
  if (!a || !b) return 0;
  WARMSLIP_PETSC(VecDot(a, b, &value));
  return value;
}

// (a1 - a0) . (b1 - b0) without forming the differences
template <int d>
double dot_of_changes(const Layout<d>& layout, Vec a1, Vec a0, Vec b1, Vec b0) {
  if (!b1) return 0;
  Values x1(a1), x0(a0), y1(b1), y0(b0);
  return layout.sum(((*x1) - (*x0)).dot((*y1) - (*y0)));
}

// Against the size of what was added; numbers whose squares are lost to underflow count as none.
double relative(double residual, double size) {
  return size > std::numeric_limits<double>::min() ? std::abs(residual) / size : residual == residual ? 0 : residual;
}

double largest_of(std::initializer_list<double> terms) {
  double largest = 0;
  for (const double term : terms) largest = std::max(largest, std::abs(term));
  return largest;
}

// Sum of |entries| of every row that this rank owns; the largest of the rows of a node.
Eigen::VectorXd row_sizes(Mat a) {
  if (!a) return {};
  PetscInt begin, end;
  WARMSLIP_PETSC(MatGetOwnershipRange(a, &begin, &end));
  Eigen::VectorXd sizes = Eigen::VectorXd::Zero(end - begin);
  for (PetscInt row = begin; row < end; ++row) {
    PetscInt count;
    const PetscScalar* entries;
    WARMSLIP_PETSC(MatGetRow(a, row, &count, nullptr, &entries));
    for (PetscInt e = 0; e < count; ++e) sizes[row - begin] += std::abs(entries[e]);
    WARMSLIP_PETSC(MatRestoreRow(a, row, &count, nullptr, &entries));
  }
  PetscInt block;
  WARMSLIP_PETSC(MatGetBlockSizes(a, &block, nullptr));
  return sizes.reshaped(block, sizes.size() / block).colwise().maxCoeff().transpose();
}

// Largest of some sizes over all nodes of all ranks.
template <std::size_t count>
std::array<double, count> over_ranks(MPI_Comm comm, std::array<double, count> most) {
  MPI_Allreduce(MPI_IN_PLACE, most.data(), static_cast<int>(count), MPI_DOUBLE, MPI_MAX, comm);
  return most;
}

// Sums of nodal forces and of their moments, and of their sizes.
template <int d>
struct Resultant {
  static constexpr int moments = d == 2 ? 1 : 3, many = d + moments;
  Eigen::Vector<double, many> sum = Eigen::Vector<double, many>::Zero(), size = sum;
  // a force at a place, and the magnitudes of its own terms
  void add(const Point<d>& x, const Point<d>& f, double magnitude) {
    sum.template head<d>() += f;
    if constexpr (d == 2)
      sum[2] += x[0] * f[1] - x[1] * f[0];
    else
      sum.template tail<3>() += x.cross(f);
    size.template head<d>().array() += magnitude;
    size.template tail<moments>().array() += x.norm() * magnitude;
  }
};

}  // namespace

template <int d>
Bookkeeper<d>::Bookkeeper(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators,
                          const ContactSurface<d>& surface)
    : layout_(layout),
      problem_(problem),
      operators_(operators),
      surface_(surface),
      elastic_rows_(row_sizes(operators.elasticity)),
      viscous_rows_(row_sizes(operators.viscosity)),
      expansion_rows_(row_sizes(operators.expansion)),
      mass_rows_(row_sizes(operators.mass)),
      conduction_rows_(row_sizes(operators.conductivity)),
      exchange_rows_(row_sizes(operators.exchange)),
      heating_rows_(row_sizes(operators.heating)),
      unknowns_(surface.unknowns(d)),
      nodes_(surface.global_nodes()) {
  if (operators.inertia) {  // its entries are positive
    const VecHandle ones = layout.vector(d), sums = layout.vector(d);
    WARMSLIP_PETSC(VecSet(ones, 1));
    multiply(operators.inertia, ones, sums);
    inertia_rows_ = (*Values(sums)).reshaped(d, layout.owned()).colwise().maxCoeff().transpose();
  }
  if (operators.viscosity) viscous_w_ = layout.vector(d);
  if (surface.points() > 0) contact_force_ = layout.vector(d);
  if (operators.conductivity) conducted_ = layout.vector(1);
  if (operators.exchange) exchanged_ = layout.vector(1);
  if (operators.conductivity && problem.contact_heats()) {
    contact_heat_ = layout.vector(1);
    contact_heat_size_ = layout.vector(1);
  }
  centroid_ = layout.mesh().nodes.colwise().mean().transpose();
  const PetscInt first = layout.owned() ? layout.global_nodes()[0] : 0;
  for (PetscInt& i : unknowns_) i -= first * d;
  for (PetscInt& i : nodes_) i -= first;
  clamped_.resize(static_cast<std::size_t>(layout.owned()));
  cooled_.resize(clamped_.size());
  for (const PetscInt i : operators.clamped) clamped_[static_cast<std::size_t>(i / d - first)] = true;
  for (const PetscInt i : operators.cooled) cooled_[static_cast<std::size_t>(i - first)] = true;
  for (const auto& [rows, size] :
       {std::pair{&heating_rows_, &heating_}, std::pair{&mass_rows_, &mass_},
        std::pair{&conduction_rows_, &conduction_}, std::pair{&exchange_rows_, &exchange_}}) {
    size->sum = layout.sum(rows->size() ? rows->sum() : 0.0);
    size->most = over_ranks(layout.comm(), std::array{rows->size() ? rows->maxCoeff() : 0.0})[0];
  }
  any_cooled_ = layout.sum(static_cast<double>(operators.cooled.size())) > 0;
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
  interpolate_anew();
}

template <int d>
Ledger Bookkeeper<d>::close(const Level& before, const Level& after, const StepInputs& in) {
  if (after.w) multiply(operators_.viscosity, after.straining(), viscous_w_);
  multiply(operators_.conductivity, after.theta, conducted_);
  multiply(operators_.exchange, after.theta, exchanged_);
  return terms(before, after, in);
}

template <int d>
void Bookkeeper<d>::weigh(const Level& before, const Level& after, const StepInputs& in) {
  keeps_ = true;
  terms(before, after, in);
  keeps_ = false;
}

template <int d>
Ledger Bookkeeper<d>::terms(const Level& before, const Level& after, const StepInputs& in) {
  Ledger ledger{};
  work_magnitude_ = 0;
  if (surface_.points() > 0) contact(before, after, in, ledger);
  if (after.w) {
    forces(before, after, in, ledger);
    energy(before, after, in, ledger);
  }
  if (after.theta) heat(before, after, in, ledger);
  return ledger;
}

// Momentum tested with k w_n.
template <int d>
void Bookkeeper<d>::energy(const Level& before, const Level& after, const StepInputs& in, Ledger& l) {
  const double kinetic_before = 0.5 * dot(before.w, before.momentum),
               elastic_before = 0.5 * dot(before.shape(), before.elastic_u);
  l.kinetic = 0.5 * dot(after.w, after.momentum);
  l.elastic = 0.5 * dot(after.shape(), after.elastic_u);
  l.kinetic_change = l.kinetic - kinetic_before;
  l.elastic_change = l.elastic - elastic_before;
  l.inertia_damping = 0.5 * dot_of_changes(layout_, after.w, before.w, after.momentum, before.momentum);
  l.elastic_damping = 0.5 * dot_of_changes(layout_, after.shape(), before.shape(), after.elastic_u, before.elastic_u);
  l.viscous = in.k * dot(after.straining(), viscous_w_);
  l.load_work = in.k * dot(in.force, after.w);
  l.expansion_work = in.k * dot(in.expansion_theta, after.w);
  const double contact_before = l.contact - l.contact_change;
  const double sum = l.kinetic_change + l.elastic_change + l.contact_change + l.inertia_damping + l.elastic_damping +
                     l.contact_damping + l.viscous + l.friction - l.load_work - l.expansion_work - l.gap_work -
                     l.support_work;
  l.energy_residual =
      relative(sum, largest_of({l.kinetic, kinetic_before, l.elastic, elastic_before, l.contact, contact_before,
                                l.viscous, l.friction, l.load_work, l.expansion_work, l.gap_work, l.support_work}) +
                        work_magnitude_);
}

// The equation of motion at every free node, force and moment: the supports' reactions are the residuals of the fixed
// rows.
template <int d>
void Bookkeeper<d>::forces(const Level& before, const Level& after, const StepInputs& in, Ledger& l) {
  Resultant<d> force;
  double work = 0;
  enum { defect, backward, acting, applied, strained, inner };
  std::array<double, 6> most{};
  const auto raise = [&](std::size_t which, double value) { most[which] = std::max(most[which], value); };
  const double u = std::max(after.sizes.u, before.sizes.u), w = after.sizes.straining,
               w_both = std::max(after.sizes.w, before.sizes.w), theta = in.coupling_theta;
  const bool warm = theta > temperature_of_rounding(before, after, in.k);
  {
    Values m1(after.momentum), m0(before.momentum), f(in.force), e1(after.elastic_u), e0(before.elastic_u),
        b(viscous_w_), g(in.expansion_theta), c(contact_force_), velocity(after.w), s1(after.shape()),
        s0(before.shape());
    for (PetscInt i = 0; i < layout_.owned(); ++i) {
      const Point<d> position =
          layout_.mesh().nodes.row(layout_.mesh_nodes()[static_cast<std::size_t>(i)]).transpose() - centroid_;
      const auto at = [&](auto&& v) -> Point<d> {
        return v.size() ? Point<d>(v.template segment<d>(i * d)) : Point<d>(Point<d>::Zero());
      };
      const Point<d> p1 = at(*m1), p0 = at(*m0), inertia = (p1 - p0) / in.k, load = at(*f), contact_here = at(*c),
                     elastic = at(*e1), viscous = at(*b), expansion = at(*g), way = at(*velocity);
      const Point<d> external = inertia - load + contact_here, left = external + viscous + elastic - expansion;
      const auto row = [i](const Eigen::VectorXd& rows) { return rows.size() ? rows[i] : 0; };
      const auto size = [](const Point<d>& p) { return p.cwiseAbs().maxCoeff(); };
      const double given = size(load) + size(contact_here), expands = size(expansion),
                   stretches = std::max(size(elastic), size(viscous)),
                   moved = (size(p1) + size(p0) + w_both * row(inertia_rows_)) / in.k,
                   within = u * row(elastic_rows_) + w * row(viscous_rows_),
                   magnitude = moved + given + within + theta * row(expansion_rows_);
      const bool fixed = clamped_[static_cast<std::size_t>(i)];
      // a force in one direction has no rounding in another, in which the body may be free to move
      const Point<d> outer =
          fixed ? Point<d>::Zero() : Point<d>((load.cwiseAbs() + contact_here.cwiseAbs()).array() + moved);
      if (keeps_) force_external_.template segment<d>(i * d) = outer;
      if (keeps_)
        force_magnitudes_.template segment<d>(i * d) =
            fixed ? outer : Point<d>(outer.array() + (magnitude - moved - given));
      if (fixed) {
        force.add(position, external - left, magnitude);
        l.support_work += in.k * left.dot(way);
      } else {
        // inner forces cancel in the sum over a body
        force.add(position, external, moved + given + rigid_share_ * (magnitude - moved - given));
        const double rest = left.allFinite() ? size(left) : std::numeric_limits<double>::infinity();
        raise(defect, rest);
        // a point at rest has a strain rate of rounding of the rigid motion, which it stops
        const double least = after.strained && surface_.points() > 0
                                 ? 1e-5 * w_both * (in.k * row(elastic_rows_) + row(viscous_rows_))
                                 : 0;
        if (!(magnitude <= std::numeric_limits<double>::min())) raise(backward, rest / (magnitude + least));
      }
      work += magnitude * (in.k * way.cwiseAbs() + at(*s1).cwiseAbs() + at(*s0).cwiseAbs()).sum();
      if (fixed) continue;
      raise(applied, given + (warm ? expands : 0));
      raise(strained, stretches);
      raise(inner, within);
      raise(acting, std::max({moved, given, stretches, size(at(*e0)), expands}));
    }
  }
  constexpr Eigen::Index many = Resultant<d>::many;
  Eigen::VectorXd all(2 * many + 2);
  all << force.sum, force.size, work, l.support_work;
  all = layout_.sum(std::move(all));
  const auto sums = all.template head<many>(), sizes = all.template segment<many>(many);
  work_magnitude_ += all[2 * many];
  l.support_work = all[2 * many + 1];
  most = over_ranks(layout_.comm(), most);
  l.force_residual = most[backward];
  for (Eigen::Index i = 0; i < sums.size(); ++i)
    l.force_residual = std::max(l.force_residual, relative(sums[i], sizes[i]));
  l.force_defect = relative(most[defect], most[acting]);
  // where no force is applied, or a contact force of rounding alone, forces of a size that rounding of u makes are none
  const bool loaded = most[applied] > 1e-14 * most[inner];
  l.force_scale = loaded ? std::max(most[applied], most[strained]) : std::max(most[acting], 1e-11 * most[inner]);
  l.contact_scale = loaded ? 1e-9 * l.force_scale : l.force_scale;
  // and displacements whose forces could at most be so small are none
  if (stiffest_ > 0) l.displacement_scale = 1e-8 * l.force_scale / stiffest_;
  // as are those that rounding of a temperature makes
  l.displacement_scale = std::max(l.displacement_scale, 1e-8 * free_expansion_ * std::max(theta, reference_));
}

// A temperature that rounding of the velocity makes through the heating: at a node against all that holds its
// temperature, and of the whole body, where none is given, against what holds the constant.
template <int d>
double Bookkeeper<d>::temperature_of_rounding(const Level& before, const Level& after, double k) const {
  const double here = relative(heating_.most, mass_.most / k + conduction_.most + exchange_.most),
               whole = any_cooled_ ? 0 : relative(heating_.sum, mass_.sum / k + exchange_.sum);
  return 1e-10 * std::max(after.sizes.w, before.sizes.w) * std::max(here, whole);
}

// The heat balance tested with k theta_n and with 1, and its equation at every free node.
template <int d>
void Bookkeeper<d>::heat(const Level& before, const Level& after, const StepInputs& in, Ledger& l) {
  const double stored_before = 0.5 * dot(before.theta, before.mass_theta),
               stored = 0.5 * dot(after.theta, after.mass_theta);
  double content = 0, content_size = 0, work = 0;
  enum { defect, backward, acting };
  std::array<double, 3> most{};
  const auto raise = [&](std::size_t which, double value) { most[which] = std::max(most[which], value); };
  const double theta = after.sizes.theta, both = std::max(theta, before.sizes.theta), w = in.coupling_w;
  // a velocity that strains is known to the rounding of one that carries the body: a millionth is as far from it as
  // round-off is from the bound on a balance
  const double carried = std::max(0.0, 1e-6 * std::max(after.sizes.w, before.sizes.w) - w);
  {
    Values t1(after.mass_theta), t0(before.mass_theta), q(in.heat), h(in.heating_w), flux(conducted_), x(exchanged_),
        c(contact_heat_), sizes(contact_heat_size_), values(after.theta), old(before.theta);
    const auto at = [](auto&& v, PetscInt i) { return v.size() ? v[i] : 0.0; };
    for (PetscInt i = 0; i < layout_.owned(); ++i) {
      const double storage = ((*t1)[i] - (*t0)[i]) / in.k, supply = at(*q, i), heating = at(*h, i),
                   exchange = at(*x, i) + at(*c, i);
      const double external = storage + exchange - supply - heating, wall = external + (*flux)[i];
      const double given = std::abs(exchange) + std::abs(supply) + std::abs(heating);
      const double terms = given + 2 * both * mass_rows_[i] / in.k + theta * conduction_rows_[i] +
                           theta * at(exchange_rows_, i) + at(*sizes, i) + w * at(heating_rows_, i),
                   magnitude = terms + carried * at(heating_rows_, i);
      content += cooled_[static_cast<std::size_t>(i)] ? external - wall : external;
      content_size += magnitude;
      if (keeps_) heat_magnitudes_[i] = cooled_[static_cast<std::size_t>(i)] ? 0 : terms;
      if (keeps_) heat_external_[i] = cooled_[static_cast<std::size_t>(i)] ? 0 : terms - theta * conduction_rows_[i];
      if (cooled_[static_cast<std::size_t>(i)]) {
        l.held += in.k * wall * (*values)[i];
      } else {
        raise(defect, std::abs(wall));
        if (magnitude > std::numeric_limits<double>::min()) raise(backward, std::abs(wall) / magnitude);
        if (!std::isfinite(wall)) raise(backward, std::numeric_limits<double>::infinity());
      }
      work += in.k * magnitude * (std::abs((*values)[i]) + std::abs((*old)[i]));
      raise(acting, std::max({(std::abs((*t1)[i]) + std::abs((*t0)[i])) / in.k, std::abs((*flux)[i]), given}));
    }
  }
  Eigen::VectorXd all(4);
  all << l.held, content, content_size, work;
  all = layout_.sum(std::move(all));
  l.held = all[0];
  l.heat_change = stored - stored_before;
  l.heat_damping = 0.5 * dot_of_changes(layout_, after.theta, before.theta, after.mass_theta, before.mass_theta);
  l.conducted = in.k * dot(after.theta, conducted_);
  l.exchanged += in.k * dot(after.theta, exchanged_);
  l.supplied = in.k * dot(in.heat, after.theta);
  l.heating = in.k * dot(in.heating_w, after.theta);
  const double sum =
      l.heat_change + l.heat_damping + l.conducted + l.exchanged - l.supplied - l.heating - l.friction_heating - l.held;
  most = over_ranks(layout_.comm(), most);
  l.heat_residual = std::max({most[backward], relative(all[1], all[2]),
                              relative(sum, largest_of({stored, stored_before, l.heat_damping, l.conducted, l.exchanged,
                                                        l.supplied, l.heating, l.friction_heating, l.held}) +
                                                all[3])});
  l.heat_defect = relative(most[defect], most[acting]);
  l.temperature_scale = temperature_of_rounding(before, after, in.k);
}

template class Bookkeeper<2>;
template class Bookkeeper<3>;

}  // namespace warmslip
