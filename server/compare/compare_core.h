// What comparisons have beside the service's other state.
#pragma once

#include "server/compare/comparison_queue.h"
#include "server/compare/comparison_request.h"
#include "server/compare/reference_store.h"
#include "server/sessions/service_core.h"

namespace helio {

struct CompareCore {
  static constexpr std::size_t kMaxWaiting = 16;

  explicit CompareCore(ServiceCore& service)
      : core(service), references(service.config.max_reference_memory, service.memory), queue(kMaxWaiting) {
    core.room.set_spare(&references);
  }
  ~CompareCore() { core.room.set_spare(nullptr); }

  ComparisonLimits limits() const {
    return {core.render_limits(), core.config.max_compare_units, core.config.max_compare_pixels, core.oidn != nullptr,
            core.config.allow_exclusive};
  }

  ServiceCore& core;
  ReferenceStore references;
  ComparisonQueue queue;  // destroyed first: what runs uses the above
};

}  // namespace helio
