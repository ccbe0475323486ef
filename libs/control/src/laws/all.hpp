#pragma once
#include <array>

#include "whirl/control/method.hpp"

namespace whirl::control {

// The laws of the catalogue in the order in which they are listed; one line and one name for a new one.
LawEntry tsmc_paper_law();
LawEntry tsmc_law();
LawEntry pd_law();
LawEntry pid_law();
LawEntry lqr_law();
LawEntry mpc_law();
LawEntry lsmc_law();
LawEntry ntsmc_law();
LawEntry ftsmc_law();
LawEntry nftsmc_law();
LawEntry sta_law();
LawEntry smc_implicit_law();
LawEntry tsmc_implicit_law();
LawEntry sta_implicit_law();
LawEntry asmc_law();
LawEntry bsmc_law();
LawEntry pd_influence_law();
LawEntry pd_fxlms_law();
LawEntry pd_notch_law();
LawEntry learned_law();
LawEntry pd_fxlms_xy_law();
LawEntry pd_scheduled_law();
LawEntry lqi_law();
LawEntry hinf_law();
LawEntry state_space_law();

inline constexpr std::array kLaws{
    tsmc_paper_law,    tsmc_law,         pd_law,          pid_law,          lqr_law,          mpc_law,
    lsmc_law,          ntsmc_law,        ftsmc_law,       nftsmc_law,       sta_law,          smc_implicit_law,
    tsmc_implicit_law, sta_implicit_law, asmc_law,        bsmc_law,         pd_influence_law, pd_fxlms_law,
    pd_notch_law,      learned_law,      pd_fxlms_xy_law, pd_scheduled_law, lqi_law,          hinf_law,
    state_space_law};

}  // namespace whirl::control
