// What a person at the viewer waits for: peers/viewer_bench.py in a browser on this machine.
#include <filesystem>

#include "tests/bench/peers/script_figures.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace fs = std::filesystem;

Status run_viewer(BenchContext& context, Figures& figures) {
  const BenchOptions& options = context.options();
  const std::string heliograph = (fs::path(options.daemon).parent_path() / "heliograph").string();
  return add_script_figures("viewer_bench.py",
                            {(fs::path(HELIO_SOURCE_DIR) / "tests/browser").string(), heliograph, options.daemon,
                             context.cornell().string()},
                            "viewer",
                            {{"view.url_s", {"s", 0.7}},
                             {"page.bytes", {"bytes", 150e3}},
                             {"page.first_whole_s", {"s", 1}},
                             {"input_to_pixel.default.p50_ms", {"ms", 100}},
                             {"input_to_pixel.default.p95_ms", {"ms", std::nullopt}},
                             {"input_to_pixel.15ms.p50_ms", {"ms", 65}},
                             {"input_to_pixel.15ms.p95_ms", {"ms", std::nullopt}},
                             {"drag.pictures_per_s", {"1/s", 10, Better::higher}},
                             {"drag.megabytes_per_s", {"MB/s", std::nullopt, Better::higher}},
                             {"drag.http_thread_share", {"", std::nullopt}},
                             {"drag.http_thread_share_at_20", {"", 0.15}},
                             {"drag.daemon_cores", {"", std::nullopt}},
                             {"drag.browser_cores", {"", std::nullopt}}},
                            figures);
}

}  // namespace helio::bench
