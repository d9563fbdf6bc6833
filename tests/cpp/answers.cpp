// The answer does not depend on how the core was compiled. `answers FILE` writes the final fields of a set of problems;
// `answers FILE OTHER` compares FILE with what another build wrote: to 1e-12 of the largest entry of each field. Exit
// code 77: there is no other build to compare with.
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <sstream>

#include "paper.hpp"

using namespace warmslip;

namespace {

constexpr double bound = 1e-12;
constexpr int steps = 6, nothing_to_compare = 77;

/// One line a field: its name and its entries, exactly.
void write(std::ostream& out, const std::string& name, const Eigen::VectorXd& values) {
  char digits[40];
  out << name;
  for (const double value : values) {
    std::snprintf(digits, sizeof digits, " %a", value);
    out << digits;
  }
  out << '\n';
}

template <int d>
void solve(std::ostream& out, const std::string& name, const PaperProblem<d>& paper, Coupling coupling,
           Backend backend = Backend::automatic) {
  Stepper<d> stepper = paper.stepper({1.0 / steps, coupling, backend, {}});
  paper.start(stepper);
  for (int n = 0; n < steps; ++n)
    if (const auto report = stepper.advance(paper.loads()); report.outcome != Outcome::completed)
      throw std::runtime_error(name + " stopped: " + report.reason);
  const TimeLevel& end = stepper.level();
  write(out, name + ":u", paper.layout.gather(end.u));
  write(out, name + ":w", paper.layout.gather(end.w));
  write(out, name + ":theta", paper.layout.gather(end.theta));
  write(out, name + ":force", stepper.contact_force());
}

template <int d>
void solve_all(std::ostream& out, int n) {
  const std::string dim = std::to_string(d) + "d ";
  for (const auto& [name, coupling] :
       {std::pair{"staggered", Coupling::staggered}, std::pair{"lagged", Coupling::lagged},
        std::pair{"monolithic", Coupling::monolithic}})
    for (const int quadrature : {0, 2})
      solve(out, dim + name + (quadrature ? " gauss" : " nodal"), PaperProblem<d>(n, 1, quadrature), coupling);
  solve(out, dim + "free", PaperProblem<d>(n, 1, 0, false), Coupling::staggered);
  solve(out, dim + "petsc", PaperProblem<d>(n), Coupling::staggered, Backend::petsc);
  solve(out, dim + "skewed", PaperProblem<d>(n, -1), Coupling::monolithic);
}

std::vector<double> numbers(std::istringstream& line) {
  std::vector<double> found;
  for (std::string word; line >> word;) found.push_back(std::strtod(word.c_str(), nullptr));
  return found;
}

/// Whether two lines are the same field to `bound`.
bool alike(const std::string& one, const std::string& other) {
  const auto at = one.find(" 0x"), sign = one.find(" -0x");
  const std::string name = one.substr(0, std::min(at, sign));
  if (other.compare(0, name.size(), name) != 0) return false;
  std::istringstream left(one.substr(name.size())), right(other.substr(name.size()));
  const std::vector<double> a = numbers(left), b = numbers(right);
  if (a.size() != b.size()) return false;
  double size = 0, away = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    size = std::max(size, std::abs(b[i]));
    away = std::max(away, std::abs(a[i] - b[i]));
  }
  const bool near = away <= bound * size;
  std::cout << name << ": " << (size > 0 ? away / size : away) << (near ? "\n" : " is more than it may be\n");
  return near;
}

int compare(const char* one, const char* other) {
  std::ifstream first(one), second(other);
  if (!second) {
    std::cout << other << " is not there: nothing is compared\n";
    return nothing_to_compare;
  }
  bool all = first.good();
  std::string a, b;
  while (std::getline(first, a)) all = std::getline(second, b) && alike(a, b) && all;
  return all && !std::getline(second, b) ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 3) return compare(argv[1], argv[2]);
  PetscCall(PetscInitialize(&argc, &argv, nullptr, nullptr));
  {
    std::ofstream out(argv[1]);
    solve_all<2>(out, 6);
    solve_all<3>(out, 3);
  }
  PetscCall(PetscFinalize());
  return 0;
}
