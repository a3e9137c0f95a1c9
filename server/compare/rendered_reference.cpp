#include "server/compare/rendered_reference.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "renderer/base/hash.h"
#include "renderer/codec/sha256.h"
#include "server/base/build_info.h"
#include "server/stream/convert.h"
#include "server/stream/settings_messages.h"

namespace helio {
namespace {

constexpr std::uint32_t kFirstSamples = 16;  // of either half: fewer say little of the error
constexpr std::uint32_t kBlack = 512;        // of either half, after which a picture is taken for black
// Of the samples that the error so far asks for: it is an estimate.
constexpr double kMargin = 1.05;
// No step is longer, so that an error that was estimated too large costs little.
constexpr std::uint32_t kMostGrowth = 8;

// Seeds that no unit has: those are below 2^53.
std::uint64_t half_seed(const ReferenceRequest& request, int half) {
  return hash64(request.settings.seed ^ (0x7265666572656e63u + std::uint64_t(half))) | 1ull << 63;
}

void take_mean(const Picture& a, const Picture& b, Picture& mean) {
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < mean.channels[c].size(); ++i)
      mean.channels[c][i] = 0.5f * a.channels[c][i] + 0.5f * b.channels[c][i];
  }
}

// Of either half, for the error: it falls with the root of the samples.
std::uint32_t next_samples(std::uint32_t now, std::optional<double> error, double wanted, std::uint32_t most) {
  double next = 2.0 * now;
  if (error && *error > 0) next = std::ceil(kMargin * now * (*error / wanted) * (*error / wanted));
  next = std::clamp(next, 1.25 * now, double(kMostGrowth) * now);
  return std::uint32_t(std::min(std::ceil(next), double(most)));
}

}  // namespace

std::string rendered_reference_id(const LoadedScene& scene, const CameraPose& view, const ReferenceRequest& request) {
  Sha256 hash;
  hash.update(std::string_view(scene.id));
  hash.update(std::string_view(to_message(view).SerializeAsString()));
  RenderSettings settings = request.settings;
  settings.seed = 0;
  hash.update(std::string_view(to_message(settings).SerializeAsString()));
  hash.update(std::string_view(fmt::format("{} {} {} {} {}", request.error, request.max_samples, build_version(),
                                           build_description(), rendering_isa())));
  return to_hex(hash.finish());
}

Result<std::shared_ptr<const ReferencePicture>> render_reference(
    const RenderContext::Resources& resources, MemoryAccount& kept, const std::shared_ptr<const LoadedScene>& scene,
    const CameraPose& view, const ReferenceRequest& request, const CancelToken& cancel,
    const std::function<void(const ReferenceProgress&)>& told) {
  auto reference = std::make_shared<ReferencePicture>();
  reference->id = rendered_reference_id(*scene, view, request);
  const int width = request.settings.width, height = request.settings.height;
  auto memory = kept.reserve_with_room(picture_bytes(width, height, 3), "a reference", MemoryOwner::references);
  if (!memory) return memory.error();
  reference->memory = std::move(*memory);
  reference->mean = Picture(width, height);

  ComparedMode mode;
  mode.name = "reference";
  mode.settings = request.settings;
  std::unique_ptr<ComparedSession> halves[2];
  for (int h = 0; h < 2; ++h) {
    auto session = ComparedSession::create(resources, scene, mode, half_seed(request, h));
    if (!session) return session.error();
    halves[h] = std::move(*session);
  }
  const std::uint32_t most = std::max(request.max_samples / 2, 1u);
  std::uint32_t done = 0, samples = std::min(kFirstSamples, most);
  for (;;) {
    Budget budget;
    budget.samples = samples;
    for (int h = 0; h < 2; ++h) {
      const auto idle = [&](const FrameProgress& progress) {
        const double other = h == 0 ? done : samples;
        told({progress.samples_per_pixel + other, reference->error.value_or(0)});
      };
      const auto cost =
          done == 0 ? halves[h]->render(view, budget, cancel, idle) : halves[h]->go_on(budget, cancel, idle);
      if (!cost) return cost.error();
    }
    done = samples;
    reference->half_a = halves[0]->picture();
    reference->half_b = halves[1]->picture();
    take_mean(*reference->half_a, *reference->half_b, reference->mean);
    reference->samples = 2 * done;
    reference->error = reference_error(reference->view());
    told({double(2 * done), reference->error.value_or(0)});
    // Black pictures have no relative error; light through a keyhole is given a chance to be found.
    if (done >= most || (!reference->error && done >= kBlack)) break;
    if (reference->error && *reference->error <= request.error) break;
    samples = next_samples(done, reference->error, request.error, most);
  }
  return std::shared_ptr<const ReferencePicture>(std::move(reference));
}

}  // namespace helio
