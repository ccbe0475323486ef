#pragma once
#include <vector>

#include "fit/band.hpp"
#include "whirl/modal/poles.hpp"

namespace whirl::modal {

// The methods that pLSCF is compared with. Poles of every order, those that can be modes.
std::vector<StabilisationPole> lsce_poles(const Band& band, const Grid& grid, const Orders& orders, double max_damping);
std::vector<StabilisationPole> era_poles(const Band& band, const Grid& grid, const Orders& orders, double max_damping);
std::vector<StabilisationPole> rational_poles(const Band& band, const Grid& grid, const Orders& orders,
                                              double max_damping);

}  // namespace whirl::modal
