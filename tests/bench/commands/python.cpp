// What the Python package adds to a render: peers/python_bench.py.
#include <filesystem>

#include "tests/bench/peers/script_figures.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace fs = std::filesystem;

Status run_python(BenchContext& context, Figures& figures) {
  return add_script_figures("python_bench.py",
                            {(fs::path(HELIO_SOURCE_DIR) / "client/python").string(), context.options().daemon,
                             context.cornell().string()},
                            "python",
                            {{"import_s", {"s", 0.4}},
                             {"tiles.float_ms", {"ms", 15}},
                             {"tiles.float_checks_ms", {"ms", std::nullopt}},
                             {"tiles.half_ms", {"ms", std::nullopt}},
                             {"tiles.half_checks_ms", {"ms", std::nullopt}},
                             {"tiles.zip_ms", {"ms", std::nullopt}},
                             {"tiles.zip_checks_ms", {"ms", std::nullopt}},
                             {"first_picture.beside_render_ms", {"ms", 20}}},
                            figures);
}

}  // namespace helio::bench
