// Pass: takes back what fresh samples contradict of the history that pixels carry (film/history/history_rejection.h).
#pragma once

#include "renderer/film/history/history_rejection.h"
#include "renderer/frame/stages/sweeps.h"

namespace helio {

using RejectionPiece = SweepPiece<HistoryRejection>;
using RejectionPass = SweepPass<HistoryRejection>;

}  // namespace helio
