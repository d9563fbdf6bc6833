// The equation of motion at every node, and the balances of force and moment of the whole body.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "warmslip/time/balances.hpp"

namespace warmslip {
namespace {

// Sums of nodal forces and of their moments, and of their sizes.
template <int d>
struct Resultant {
  static constexpr int moments = d == 2 ? 1 : 3, many = d + moments;
  Eigen::Vector<double, many> sum = Eigen::Vector<double, many>::Zero(), size = sum;
  // a force at a place, and the magnitudes of its own terms: outer ones, and inner ones that count in part
  void add(const Point<d>& x, const Point<d>& f, const Point<d>& outer, double inner,
           const Eigen::Vector<double, many>& shares) {
    sum.template head<d>() += f;
    if constexpr (d == 2)
      sum[2] += x[0] * f[1] - x[1] * f[0];
    else
      sum.template tail<3>() += x.cross(f);
    Eigen::Vector<double, many> magnitude = inner * shares;
    magnitude.template head<d>() += outer;
    magnitude.template tail<moments>().array() += outer.maxCoeff();
    size.template head<d>() += magnitude.template head<d>();
    size.template tail<moments>() += x.norm() * magnitude.template tail<moments>();
  }
};

// The motion along a force, or about the axis of a moment, by its place among the resultants.
template <int d>
Point<d> motion_of(Eigen::Index resultant, const Point<d>& x) {
  if (resultant < d) return Point<d>::Unit(resultant);
  if constexpr (d == 2)
    return {-x[1], x[0]};
  else
    return Point<3>::Unit(resultant - 3).cross(x);
}

}  // namespace

template <int d>
void BalanceEvaluator<d>::take_shares(const RigidMotions& rigid, bool sprung) {
  shares_.setOnes();
  sprung_ = sprung;
  if (!rigid.apart()) return;
  const VecHandle motion = layout_.vector(d);
  for (Eigen::Index resultant = 0; resultant < shares_.size(); ++resultant) {
    {
      Values values(motion);
      for (PetscInt i = 0; i < layout_.owned(); ++i)
        (*values).template segment<d>(i * d) = motion_of<d>(
            resultant,
            layout_.mesh().nodes.row(layout_.mesh_nodes()[static_cast<std::size_t>(i)]).transpose() - centroid_);
    }
    if (rigid.contains(motion)) shares_[resultant] = rigid.share();
  }
}

// The equation of motion at every free node, force and moment: the supports' reactions are the residuals of the fixed
// rows.
template <int d>
void BalanceEvaluator<d>::forces(const TimeLevel& before, const TimeLevel& after, const StepInputs& in, Balances& l) {
  Resultant<d> force;
  double work = 0;
  enum { defect, backward, acting, applied, pressed, strained, inner, carried };
  std::array<double, 8> largest{};
  const auto raise = [&](std::size_t which, double value) { largest[which] = std::max(largest[which], value); };
  const double u = std::max(after.sizes.u, before.sizes.u), w = after.sizes.straining,
               w_both = std::max(after.sizes.w, before.sizes.w), theta = in.coupling_theta,
               reach = std::max(after.reach.maxCoeff(), before.reach.maxCoeff()),
               pressing = in.contact_force.size() ? in.contact_force.template lpNorm<Eigen::Infinity>() : 0;
  const bool warm =
      std::max(theta, std::abs(operators_.common_reference)) > temperature_of_rounding(before, after, in.k);
  {
    Values m1(after.momentum), m0(before.momentum), f(in.force), e1(after.elastic_u), e0(before.elastic_u),
        b(viscous_w_), g(in.expansion_theta), c(contact_force_), velocity(after.w), s1(after.shape()),
        s0(before.shape()), reactions(reactions_), springs(springs_), dashpots(dashpots_),
        supported(in.support_velocity);
    for (PetscInt i = 0; i < layout_.owned(); ++i) {
      const Point<d> position =
          layout_.mesh().nodes.row(layout_.mesh_nodes()[static_cast<std::size_t>(i)]).transpose() - centroid_;
      const auto at = [&](auto&& v) -> Point<d> {
        return v.size() ? Point<d>(v.template segment<d>(i * d)) : Point<d>(Point<d>::Zero());
      };
      const Point<d> p1 = at(*m1), p0 = at(*m0), inertia = (p1 - p0) / in.k, load = at(*f), contact_here = at(*c),
                     elastic = at(*e1), viscous = at(*b), expansion = at(*g), way = at(*velocity);
      const Point<d> springy = springs_ || dashpots_ ? Point<d>(at(*springs) + at(*dashpots)) : Point<d>::Zero();
      const Point<d> external = inertia - load + contact_here, left = external + viscous + elastic - expansion;
      const auto row = [i](const Eigen::VectorXd& rows) { return rows.size() ? rows[i] : 0; };
      const auto size = [](const Point<d>& p) { return p.cwiseAbs().maxCoeff(); };
      // of a warm body too the forces of its temperature count, not of its difference to that of reference alone
      const double given = size(load) + size(contact_here),
                   expands = std::max(size(expansion), std::abs(operators_.common_reference) * row(expansion_rows_)),
                   stretches = std::max(size(elastic), size(viscous)),
                   moved = (size(p1) + size(p0) + w_both * row(inertia_rows_)) / in.k;
      const auto resists = [i](const Eigen::VectorXd& rows) {
        return rows.size() ? Point<d>(rows.template segment<d>(i * d)) : Point<d>(Point<d>::Zero());
      };
      const Point<d> sprung = reach * resists(spring_rows_) + after.sizes.w * resists(dashpot_rows_),
                     beside = (sprung_ ? 1 : 0) * sprung;  // springs resist more than what strains
      const double within = u * row(elastic_rows_) + w * row(viscous_rows_),
                   inner_forces = within + theta * row(expansion_rows_),
                   magnitude = moved + given + inner_forces + beside.maxCoeff();
      const int support = support_[static_cast<std::size_t>(i)];
      const Tensor2<d>* held = support >= 0 ? &held_[static_cast<std::size_t>(support)] : nullptr;
      const bool fixed = held && held->isIdentity(0);
      // a force in one direction has no rounding in another, in which the body may be free to move
      const Point<d> outer = fixed ? Point<d>(Point<d>::Zero())
                                   : Point<d>((load.cwiseAbs() + contact_here.cwiseAbs() + beside).array() + moved);
      if (stores_magnitudes_) force_external_.template segment<d>(i * d) = outer;
      if (stores_magnitudes_)
        force_magnitudes_.template segment<d>(i * d) = fixed ? outer : Point<d>(outer.array() + inner_forces);
      if (held) {
        const Point<d> reaction = *held * left;
        const double missed = size(*held * (way - at(*supported)));  // what supports prescribe
        if (missed > 0) raise(backward, missed / w_both);
        force.add(position, external + springy - reaction, Point<d>::Constant(magnitude), 0, shares_);
        l.support_work += in.k * reaction.dot(way);
        (*reactions).template segment<d>(i * d) = reaction;
      } else {
        // inner forces cancel in the sum over a body; those of springs along a normal are sums of larger terms
        force.add(position, external + springy, Point<d>(sprung.array() + moved + given), inner_forces, shares_);
      }
      if (!fixed) {
        const Point<d> over = held ? Point<d>(left - *held * left) : left;
        const double rest = over.allFinite() ? size(over) : std::numeric_limits<double>::infinity();
        raise(defect, rest);
        // a point at rest has a strain rate of rounding of the rigid motion, which it stops, or of the velocity that
        // it would have without its contact force
        const double stops = after.strained && surface_.points() > 0
                                 ? 1e-5 * w_both * (in.k * row(elastic_rows_) + row(viscous_rows_))
                                 : 0,
                     least = stops + std::numeric_limits<double>::epsilon() * pressing;
        if (!(magnitude <= std::numeric_limits<double>::min())) raise(backward, rest / (magnitude + least));
      }
      work += magnitude * (in.k * way.cwiseAbs() + at(*s1).cwiseAbs() + at(*s0).cwiseAbs()).sum();
      if (fixed) continue;
      raise(applied, size(load) + (warm ? expands : 0));
      raise(pressed, size(contact_here));
      raise(strained, stretches);
      raise(inner, within);
      raise(carried, moved);
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
  largest = over_ranks(layout_.comm(), largest);
  l.force_residual = largest[backward];
  for (Eigen::Index i = 0; i < sums.size(); ++i)
    l.force_residual = std::max(l.force_residual, relative(sums[i], sizes[i]));
  l.force_defect = relative(largest[defect], largest[acting]);
  // a contact force may be rounding of u or of a momentum
  if (largest[pressed] > 1e-14 * std::max(largest[inner], largest[carried]))
    largest[applied] = std::max(largest[applied], largest[pressed]);
  // where no force is applied, forces of a size that rounding of u makes are none
  const bool loaded = largest[applied] > 1e-14 * largest[inner];
  l.force_scale =
      loaded ? std::max(largest[applied], largest[strained]) : std::max(largest[acting], 1e-11 * largest[inner]);
  l.contact_scale = loaded ? 1e-9 * l.force_scale : l.force_scale;
  // and displacements whose forces could at most be so small are none
  if (stiffest_ > 0) l.displacement_scale = 1e-8 * l.force_scale / stiffest_;
  // as are those that rounding of a temperature makes
  l.displacement_scale = std::max(l.displacement_scale, 1e-8 * free_expansion_ * std::max(theta, reference_));
}

template class BalanceEvaluator<2>;
template class BalanceEvaluator<3>;

}  // namespace warmslip
