#include "renderer/frame/checkpoint/checkpoint_maker.h"

#include "renderer/base/check.h"

namespace helio {

CheckpointMaker::CheckpointMaker(CheckpointOptions options, const RenderSettings& settings)
    : clock(options.interval_s), options_(std::move(options)) {
  HELIO_CHECK(options_.keep);
  if (!options_.prepare_later) set_memory(make_memory(settings));
}

std::shared_ptr<CheckpointMaker::Memory> CheckpointMaker::make_memory(const RenderSettings& settings) const {
  if (!can_checkpoint(settings)) return nullptr;
  return std::make_shared<Memory>(Memory{options_.count, PictureCheckpoint(settings)});
}

bool CheckpointMaker::suits(const std::shared_ptr<Memory>& memory, const RenderSettings& settings) {
  return checkpoint_bytes(settings) == (memory ? memory->checkpoint.bytes() : 0);
}

std::shared_ptr<CheckpointMaker::Memory> CheckpointMaker::set_memory(std::shared_ptr<Memory> memory) noexcept {
  clock.set_size(memory ? memory->checkpoint.bytes() : 0);
  return std::exchange(memory_, std::move(memory));
}

std::function<void()> CheckpointMaker::keeper(const std::shared_ptr<Memory>& memory) const {
  return [memory, held = held_, keep = options_.keep] {
    held->store(true, std::memory_order_relaxed);
    const auto let_go = [memory, held](const PictureCheckpoint*) { held->store(false, std::memory_order_release); };
    keep(std::shared_ptr<const PictureCheckpoint>(&memory->checkpoint, let_go));
  };
}

}  // namespace helio
