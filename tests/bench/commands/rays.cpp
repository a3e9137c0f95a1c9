// Rays per second of the whole renderer over bare Embree calls on the same rays.
#include "tests/bench/bench_context.h"
#include "tests/bench/commands/ray_share.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace {

Status measure(const std::string& name, const std::filesystem::path& file, const BenchOptions& options,
               Figures& figures) {
  const auto scene = load_bench_scene(file, options.threads);
  if (!scene) return scene.error();
  RayShareRequest request{name, *scene, options.size, options.size};
  request.goal = 0.6;
  RenderEngine engine(options.threads);
  return add_ray_share(request, engine, options, figures);
}

}  // namespace

Status run_rays(BenchContext& context, Figures& figures) {
  if (const Status done = measure("cornell", context.cornell(), context.options(), figures); !done) return done;
  const auto room = context.room();
  if (!room) {
    note(room.error().to_string());
    return ok_status();
  }
  return measure("room", *room, context.options(), figures);
}

}  // namespace helio::bench
