// Pass: takes back what fresh samples contradict of the history that pixels carry (film/history/history_review.h).
#pragma once

#include "renderer/film/history/history_review.h"
#include "renderer/frame/passes/sweeps.h"

namespace helio {

using ReviewPiece = SweepPiece<HistoryReview>;
using ReviewPass = SweepPass<HistoryReview>;

}  // namespace helio
