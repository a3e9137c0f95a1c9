// A comparison from its references to its table: renders unit by unit, in turns, and tells each as it comes.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "renderer/metrics/flicker.h"
#include "renderer/metrics/flip_reference.h"
#include "renderer/trace/gbuffer/previous_positions.h"
#include "server/compare/compared_session.h"
#include "server/compare/comparison_request.h"
#include "server/compare/reference_store.h"

namespace helio {

class Comparison {
 public:
  // Hands a message to whoever asked; waits until it can be sent. False: nobody wants more.
  using Send = std::function<bool(const pb::CompareResponse&)>;

  Comparison(const RenderContext::Resources& resources, ReferenceStore& references,
             std::shared_ptr<const LoadedScene> scene, ComparisonRequest request);

  // Holds the references that were loaded for it. All problems together: not_found where one is not, or no longer,
  // there, else invalid_argument: of another size.
  Status take_loaded_references();
  // All but the first message (accepted), once the above has been called. Errors: cancelled, resource_exhausted,
  // internal.
  Status run(const CancelToken& cancel, const Send& send);

  pb::CompareResponse::Accepted accepted() const;

 private:
  using Key = std::tuple<std::string, std::uint32_t, std::uint32_t, std::uint32_t>;  // mode, seed, budget, view

  // What is known of a view.
  struct ViewState {
    CameraPose camera;  // fitted
    std::shared_ptr<const ReferencePicture> reference;
    std::optional<FilmPositions> before;  // of the view before
    Reservation positions;                // for them
    std::optional<FlipReference> flip;    // of the reference; none: FLIP computes that side for every picture
    Reservation flip_memory;              // for the rows that flip keeps
  };
  struct Turn {
    const ComparedMode* mode = nullptr;
    std::uint32_t seed_number = 1, budget = 0, view = 0;
  };

  Status check_memory() const;
  bool sends_pictures(const std::string& mode) const;  // of a view at least; empty: the reference's
  Status find_references();
  Status prepare_flip(ViewState& view);
  bool give_flip_back();  // frees the prepared references of all views; false: there are none
  Status play_still(const ComparedMode& mode, std::uint32_t seed_number);
  Status play_path(const ComparedMode& mode, std::uint32_t seed_number, std::uint32_t budget);
  bool is_done(const ComparedMode& mode, std::uint32_t seed_number, std::uint32_t budget) const;
  Result<std::unique_ptr<ComparedSession>> open(const Turn& turn);
  // Of the session's picture; `error_before`: of the view before, in and out.
  Status tell_unit(const Turn& turn, const ComparedSession& session, const PictureCost& cost, Picture* error_before);
  Result<std::vector<MeasuredValue>> measure(const Turn& turn, const ComparedSession& session, Picture* error_before);
  // The error of this picture takes the place of that of the view before; flicker between both, where it is known.
  // null: it is not asked for.
  void add_flicker(const Turn& turn, const Picture& picture, Picture& error_before,
                   std::vector<MeasuredValue>* values) const;
  void add_worst_pixels(const Turn& turn, const ComparedSession& session, pb::CompareUnit& unit) const;
  // variance: of the picture's values; without pixels: not known.
  Status tell_picture(const Picture& picture, const Picture& variance, pb::CompareResponse::Picture name);
  Status tell(const pb::CompareResponse& response);
  void tell_progress(const std::string& doing, const Turn& turn, double samples, double error);
  Budget budget(std::uint32_t index, bool goes_on) const;
  ComparedSession::Idle idle(const Turn& turn);

  const RenderContext::Resources resources_;
  ReferenceStore& references_;
  const std::shared_ptr<const LoadedScene> scene_;
  const ComparisonRequest request_;
  const double started_s_;
  const std::uint32_t call_;  // CompareUnit.call
  const CancelToken* cancel_ = nullptr;
  const Send* send_ = nullptr;
  std::vector<ViewState> views_;
  std::vector<pb::CompareUnit> units_;
  std::set<Key> done_;
  std::size_t came_done_ = 0;
  double rendering_seconds_ = 0;
  double told_progress_s_ = 0;
  bool gone_ = false;
};

}  // namespace helio
