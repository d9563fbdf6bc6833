#include "warmslip/fem/rigid_motions.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace warmslip {
namespace {

// The number of the part that a node hangs together with, the same on every rank.
template <int d>
std::vector<Index> connected(const Mesh<d>& mesh) {
  std::vector<Index> root(static_cast<std::size_t>(mesh.nodes.rows()));
  std::iota(root.begin(), root.end(), Index{0});
  const auto find = [&](Index i) {
    while (root[static_cast<std::size_t>(i)] != i)
      i = root[static_cast<std::size_t>(i)] = root[static_cast<std::size_t>(root[static_cast<std::size_t>(i)])];
    return i;
  };
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c)
    for (int i = 1; i <= d; ++i) {
      const Index a = find(mesh.cells(c, 0)), b = find(mesh.cells(c, i));
      root[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  for (Index i = 0; i < static_cast<Index>(root.size()); ++i) root[static_cast<std::size_t>(i)] = find(i);
  return root;
}

// Rigid motions at the nodes of one part, (block nodes, motions): translations, then rotations about the centre.
template <int d>
Eigen::MatrixXd motions_of(const Mesh<d>& mesh, const std::vector<Index>& nodes, int block) {
  const auto n = static_cast<Eigen::Index>(nodes.size());
  if (block == 1) return Eigen::MatrixXd::Ones(n, 1);
  Eigen::Matrix<double, Eigen::Dynamic, d> x(n, d);
  for (Eigen::Index i = 0; i < n; ++i) x.row(i) = mesh.nodes.row(nodes[static_cast<std::size_t>(i)]);
  x.rowwise() -= x.colwise().mean().eval();
  x /= std::max(x.cwiseAbs().maxCoeff(), 1e-300);
  constexpr int count = d * (d + 1) / 2;
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(n * d, count);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (int a = 0; a < d; ++a) out(i * d + a, a) = 1;
    int column = d;
    for (int a = 0; a < d; ++a)
      for (int b = a + 1; b < d; ++b, ++column) {
        out(i * d + a, column) = -x(i, b);
        out(i * d + b, column) = x(i, a);
      }
  }
  return out;
}

// The motions, (block nodes, motions), that linear forms of some nodes' values, by number, leave alone.
Eigen::MatrixXd unresisted(Eigen::MatrixXd z, const std::vector<Index>& nodes, const RigidMotions::Resisted& resisted,
                           const std::vector<std::size_t>& forms) {
  if (forms.empty()) return z;
  constexpr double rounding = 1e-12;
  const Eigen::Index motions = z.cols(), block = z.rows() / static_cast<Eigen::Index>(nodes.size());
  Eigen::MatrixXd products(static_cast<Eigen::Index>(forms.size()), motions);
  for (std::size_t i = 0; i < forms.size(); ++i) {
    const auto at = std::lower_bound(nodes.begin(), nodes.end(), resisted.nodes[forms[i]]) - nodes.begin();
    products.row(static_cast<Eigen::Index>(i)) =
        resisted.rows[forms[i]].transpose() * z.middleRows(static_cast<Eigen::Index>(at) * block, block);
  }
  // normals of a guide that differ by the digits of coordinates hold a body that may all but slide
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(products);
  const Eigen::Index rows = std::min(products.rows(), motions);
  const Eigen::MatrixXd triangle = qr.matrixQR().topRows(rows).template triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<Eigen::MatrixXd> found(triangle, Eigen::ComputeFullV);
  const auto resists = [&](Eigen::Index i) {
    return i < found.singularValues().size() &&
           found.singularValues()[i] > rounding * std::sqrt(static_cast<double>(forms.size()));
  };
  Eigen::Index held = 0;  // singular values fall
  while (held < motions && resists(held)) ++held;
  // a motion that supports leave to rounding moves against their reactions, which a weak spring would have to bear
  const auto exact = [](double entry) {
    return std::abs(entry - std::round(entry)) < 1e-14 ? std::round(entry) : entry;
  };
  return z * found.matrixV().rightCols(motions - held).unaryExpr(exact);
}

// The unknowns of a motion in a vector of the operator, whose further ones of a node come after them.
void take_part(Vec whole, Vec part) {
  const Eigen::Index width = block_size(whole), block = block_size(part);
  Values from(whole), to(part);
  const Eigen::Index nodes = (*to).size() / block;
  (*to).reshaped(block, nodes) = (*from).reshaped(width, nodes).topRows(block);
}

void put_part(Vec part, Vec whole) {
  const Eigen::Index width = block_size(whole), block = block_size(part);
  Values from(part), to(whole);
  const Eigen::Index nodes = (*from).size() / block;
  (*to).reshaped(width, nodes).topRows(block) = (*from).reshaped(block, nodes);
}

}  // namespace

template <int d>
RigidMotions::RigidMotions(const Layout<d>& layout, int block, int width, const Resisted& resisted,
                           const std::vector<std::string>& avoid, const Eigen::VectorXd& firmness)
    : right_(layout.vector(width)) {
  const Mesh<d>& mesh = layout.mesh();
  const std::vector<Index> root = connected(mesh);
  std::vector<bool> avoided(root.size(), false);
  for (const auto& name : avoid)
    for (const Index node : mesh.part(name).nodes.reshaped()) avoided[static_cast<std::size_t>(node)] = true;
  std::vector<std::vector<Index>> parts(root.size());
  for (std::size_t i = 0; i < root.size(); ++i)
    parts[static_cast<std::size_t>(root[i])].push_back(static_cast<Index>(i));
  std::vector<std::vector<std::size_t>> forms(root.size());
  for (std::size_t i = 0; i < resisted.nodes.size(); ++i)
    forms[static_cast<std::size_t>(root[static_cast<std::size_t>(resisted.nodes[i])])].push_back(i);
  std::vector<Eigen::VectorXd> rows;  // Z at the springs
  for (const auto& nodes : parts) {
    if (nodes.size() < 2) continue;  // a node of no cell
    const std::vector<std::size_t>& here = forms[static_cast<std::size_t>(root[static_cast<std::size_t>(nodes[0])])];
    const Eigen::MatrixXd z = unresisted(motions_of<d>(mesh, nodes, block), nodes, resisted, here);
    const Eigen::Index first = count(), several = z.cols();
    if (several == 0) continue;
    for (Eigen::Index j = 0; j < several; ++j) {
      Eigen::VectorXd values = Eigen::VectorXd::Zero(mesh.nodes.rows() * block);
      for (std::size_t i = 0; i < nodes.size(); ++i)
        values.segment(Eigen::Index{nodes[i]} * block, block) =
            z.col(j).segment(static_cast<Eigen::Index>(i) * block, block);
      motions_.push_back(layout.vector(block));
      layout.distribute(values, motions_.back());
    }
    // springs where they hold the motions best, which in soft nodes they do not, and along what supports hold not at
    // all: rows of Z by pivoting, on the nodes that are not avoided if they suffice
    Eigen::MatrixXd weighted = z;
    double firmest = 0;
    for (const Index node : nodes) firmest = std::max(firmest, firmness[node]);
    for (std::size_t i = 0; firmest > 0 && i < nodes.size(); ++i)
      weighted.middleRows(static_cast<Eigen::Index>(i) * block, block) *= std::sqrt(firmness[nodes[i]] / firmest);
    Eigen::MatrixXd candidates = weighted;
    for (std::size_t i = 0; i < nodes.size(); ++i)
      if (avoided[static_cast<std::size_t>(nodes[i])])
        candidates.middleRows(static_cast<Eigen::Index>(i) * block, block).setZero();
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(candidates.transpose());
    if (qr.rank() < several || std::abs(qr.maxPivot()) > 1e3 * std::abs(qr.matrixR()(several - 1, several - 1)))
      qr.compute(weighted.transpose());
    for (Eigen::Index j = 0; j < several; ++j) {
      const Eigen::Index row = qr.colsPermutation().indices()[j];
      springs_.push_back(layout.global_of(nodes[static_cast<std::size_t>(row / block)]) * width +
                         static_cast<PetscInt>(row % block));
      Eigen::VectorXd here = Eigen::VectorXd::Zero(first + several);
      here.tail(several) = z.row(row).transpose();
      rows.push_back(here);
    }
  }
  at_springs_ = Eigen::MatrixXd::Zero(count(), count());
  for (std::size_t i = 0; i < rows.size(); ++i)
    at_springs_.row(static_cast<Eigen::Index>(i)).head(rows[i].size()) = rows[i];
  gram_.resize(count(), count());
  for (Eigen::Index j = 0; j < count(); ++j) gram_.col(j) = dots(motions_, motions_[static_cast<std::size_t>(j)]);
}

void RigidMotions::add_springs(Mat k) {
  VecHandle diagonal;
  WARMSLIP_PETSC(MatCreateVecs(k, diagonal.out(), nullptr));
  WARMSLIP_PETSC(MatGetDiagonal(k, diagonal));
  PetscInt begin, end;
  WARMSLIP_PETSC(VecGetOwnershipRange(diagonal, &begin, &end));
  stiffness_.assign(springs_.size(), 0);
  {
    Values values(diagonal);
    for (std::size_t i = 0; i < springs_.size(); ++i)
      if (springs_[i] >= begin && springs_[i] < end) stiffness_[i] = (*values)[springs_[i] - begin];
  }
  MPI_Allreduce(MPI_IN_PLACE, stiffness_.data(), static_cast<int>(stiffness_.size()), MPI_DOUBLE, MPI_SUM,
                PetscObjectComm(reinterpret_cast<PetscObject>(k)));
  for (std::size_t i = 0; i < springs_.size(); ++i)
    if (springs_[i] >= begin && springs_[i] < end)
      WARMSLIP_PETSC(MatSetValue(k, springs_[i], springs_[i], stiffness_[i], ADD_VALUES));
  WARMSLIP_PETSC(MatAssemblyBegin(k, MAT_FINAL_ASSEMBLY));
  WARMSLIP_PETSC(MatAssemblyEnd(k, MAT_FINAL_ASSEMBLY));
}

void RigidMotions::prepare(Factor& factor, const Apply& mass) {
  respond([&](Vec r, Vec x) { factor.solve(r, x); }, mass, inner_, along_);
  if (!factor.symmetric())
    respond([&](Vec r, Vec x) { factor.solve_transposed(r, x); }, mass, inner_transposed_, along_transposed_);
  find_inertia(along_, mass);
}

void RigidMotions::prepare(const Apply& mass) { find_inertia(motions_, mass); }

// H from W, or from the motions themselves.
void RigidMotions::find_inertia(const std::vector<VecHandle>& along, const Apply& mass) {
  inertia_.resize(count(), count());
  if (empty()) return;
  const VecHandle right = duplicate(motions_.front());
  for (Eigen::Index j = 0; j < count(); ++j) {
    WARMSLIP_PETSC(VecSet(right, 0));
    mass(motions_[static_cast<std::size_t>(j)], right);
    inertia_.row(j) = dots(along, right).transpose();
  }
}

// V and W of the operator that `solve` inverts.
void RigidMotions::respond(const Solve& solve, const Apply& mass, std::vector<VecHandle>& inner,
                           std::vector<VecHandle>& along) {
  PetscInt begin, end;
  WARMSLIP_PETSC(VecGetOwnershipRange(right_, &begin, &end));
  for (Eigen::Index j = 0; j < count(); ++j) {
    const Vec z = motions_[static_cast<std::size_t>(j)];
    VecHandle v = duplicate(right_), w = duplicate(z);
    WARMSLIP_PETSC(VecSet(right_, 0));
    WARMSLIP_PETSC(VecSet(w, 0));
    mass(z, w);
    put_part(w, right_);
    solve(right_, v);
    take_part(v, w);
    PetscReal size;
    WARMSLIP_PETSC(VecNorm(w, NORM_INFINITY, &size));
    WARMSLIP_PETSC(VecAYPX(w, -1, z));
    share_ = std::max(share_, std::min(1.0, size));
    if (size > 0.5) {  // a mass that holds the motion well: Z - V would cancel
      WARMSLIP_PETSC(VecSet(right_, 0));
      {
        Values values(right_);
        for (std::size_t i = 0; i < springs_.size(); ++i)
          if (springs_[i] >= begin && springs_[i] < end)
            (*values)[springs_[i] - begin] += stiffness_[i] * at_springs_(static_cast<Eigen::Index>(i), j);
      }
      const VecHandle whole = duplicate(right_);
      solve(right_, whole);
      take_part(whole, w);
    }
    inner.push_back(std::move(v));
    along.push_back(std::move(w));
  }
}

Eigen::VectorXd RigidMotions::dots(const std::vector<VecHandle>& with, Vec x) const {
  std::vector<Vec> vectors(with.begin(), with.end());
  Eigen::VectorXd out(static_cast<Eigen::Index>(vectors.size()));
  WARMSLIP_PETSC(VecMDot(x, static_cast<PetscInt>(vectors.size()), vectors.data(), out.data()));
  return out;
}

void RigidMotions::combine(const std::vector<VecHandle>& of, const Eigen::VectorXd& by, Vec x) const {
  std::vector<Vec> vectors(of.begin(), of.end());
  WARMSLIP_PETSC(VecMAXPY(x, static_cast<PetscInt>(vectors.size()), by.data(), vectors.data()));
}

Eigen::VectorXd RigidMotions::load(Vec external, Vec all) const {
  return dots(motions_, external) - dots(inner_transposed_.empty() ? inner_ : inner_transposed_, all);
}

Eigen::VectorXd RigidMotions::alone(const Eigen::VectorXd& load) const {
  const Eigen::FullPivLU<Eigen::MatrixXd> lu(inertia_);
  if (inertia_.isZero(0) || !lu.isInvertible())
    throw SolveFailed("nothing holds the body: it has no support, no inertia and no contact");
  return lu.solve(load);
}

bool RigidMotions::holds() const {
  const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(inertia_).eigenvalues();
  return values.minCoeff() >= -1e-12 * values.cwiseAbs().maxCoeff();
}

void RigidMotions::strain(const Eigen::VectorXd& motions, Vec inner) const { combine(inner_, -motions, inner); }

Eigen::VectorXd RigidMotions::remove(Vec x) const {
  const Eigen::VectorXd motions = gram_.ldlt().solve(dots(motions_, x));
  combine(motions_, -motions, x);
  return motions;
}

bool RigidMotions::contains(Vec x) const {
  PetscReal all, left;
  WARMSLIP_PETSC(VecNorm(x, NORM_2, &all));
  remove(x);
  WARMSLIP_PETSC(VecNorm(x, NORM_2, &left));
  return left <= 1e-9 * all;
}

void RigidMotions::carry(const Eigen::VectorXd& motions, Vec x) const { combine(motions_, motions, x); }

template RigidMotions::RigidMotions(const Layout<2>&, int, int, const Resisted&, const std::vector<std::string>&,
                                    const Eigen::VectorXd&);
template RigidMotions::RigidMotions(const Layout<3>&, int, int, const Resisted&, const std::vector<std::string>&,
                                    const Eigen::VectorXd&);

}  // namespace warmslip
