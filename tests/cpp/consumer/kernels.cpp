// The kernels alone: the triangles of a square.
#include "warmslip/mesh/box.hpp"

int main() { return warmslip::box<2>({2, 2}, {1, 1}, warmslip::Diagonal::right).cells.rows() == 8 ? 0 : 1; }
