#pragma once
#include <variant>

#include "whirl/control/laws/asmc.hpp"
#include "whirl/control/laws/bsmc.hpp"
#include "whirl/control/laws/ftsmc.hpp"
#include "whirl/control/laws/learned.hpp"
#include "whirl/control/laws/lqi.hpp"
#include "whirl/control/laws/lsmc.hpp"
#include "whirl/control/laws/mpc.hpp"
#include "whirl/control/laws/nftsmc.hpp"
#include "whirl/control/laws/ntsmc.hpp"
#include "whirl/control/laws/pd.hpp"
#include "whirl/control/laws/pd_fxlms_xy.hpp"
#include "whirl/control/laws/pd_scheduled.hpp"
#include "whirl/control/laws/pd_synchronous.hpp"
#include "whirl/control/laws/pid.hpp"
#include "whirl/control/laws/smc_implicit.hpp"
#include "whirl/control/laws/sta.hpp"
#include "whirl/control/laws/state_space.hpp"
#include "whirl/control/laws/tsmc.hpp"
#include "whirl/control/laws/tsmc_implicit.hpp"

namespace whirl::control {

/// The laws a controller can hold; one line for a new one. What each is made of: src/laws.
using AnyLaw =
    std::variant<LateralLaw<TerminalSmc>, LateralLaw<LinearSmc>, LateralLaw<NonsingularTerminalSmc>,
                 LateralLaw<FastTerminalSmc>, LateralLaw<NonsingularFastTerminalSmc>, LateralLaw<ImplicitSmc>,
                 LateralLaw<ImplicitTerminalSmc>, LateralLaw<SuperTwistingSmc>, LateralLaw<AdaptiveSmc>,
                 LateralLaw<BarrierSmc>, LateralLaw<Pd>, LateralLaw<Pid>, LateralLaw<ModelPredictive>, SynchronousPd,
                 LearnedPolicy, StateSpace, LateralLaw<ScheduledPd>, MultiChannelPd, IntegralRegulator>;

}  // namespace whirl::control
