#include <filesystem>
#include <map>

#include "cli_test.h"
#include "tests/support/tier.h"

namespace helio::test {
namespace {

using CliBadInput = CliTest;

struct BadLine {
  std::vector<std::string> arguments;
  int exit_code;
  std::vector<std::string> parts;  // of the message
};

void expect_refused(const BadLine& line, const ProcessResult& result) {
  std::string words;
  for (const std::string& word : line.arguments) words += " " + word;
  SCOPED_TRACE("heliograph" + words);
  EXPECT_EQ(result.exit_code, line.exit_code) << result.err;
  EXPECT_EQ(result.out, "");
  expect_one_line(result.err);
  for (const std::string& part : line.parts) EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
}

TEST_F(CliBadInput, EveryFlagNamesItsValueAndRange) {
  const std::vector<BadLine> lines = {
      {{}, 2, {"subcommand"}},
      {{"paint"}, 2, {"'paint' is not a command: render, move, view, serve, info, scene"}},
      {{"render"}, 2, {"FILE: is missing"}},
      {{"render", "quad.gltf", "more"}, 2, {"'more': is one argument too many"}},
      {{"render", "quad.gltf", "--sample", "3"}, 2, {"--sample: is not an option of render", "--samples?"}},
      {{"render", "quad.gltf", "--samples"}, 2, {"--samples"}},
      {{"render", "quad.gltf", "--samples", "0"}, 2, {"--samples: '0'", "[1, 1073741824]"}},
      {{"render", "quad.gltf", "--samples", "-4"}, 2, {"--samples: '-4'"}},
      {{"render", "quad.gltf", "--samples", "many"}, 2, {"--samples: 'many'"}},
      {{"render", "quad.gltf", "--samples", "99999999999999999999999"}, 2, {"--samples"}},
      {{"render", "quad.gltf", "--time", "0"}, 2, {"--time: '0'", "(0, inf)"}},
      {{"render", "quad.gltf", "--time", "nan"}, 2, {"--time: 'nan'"}},
      {{"render", "quad.gltf", "--error", "-1"}, 2, {"--error: '-1'"}},
      {{"render", "quad.gltf", "--error-measure", "relmse", "--error", "1"},
       2,
       {"--error-measure: is not an option of render; did you mean --error?"}},
      {{"render", "quad.gltf", "--mode", "adaptive", "--adaptive-measure", "mse"},
       2,
       {"--adaptive-measure: 'mse' is none of rmse, relmse"}},
      {{"render", "quad.gltf", "--size", "0x10"}, 2, {"--size: '0x10'"}},
      {{"render", "quad.gltf", "--size", "10"}, 2, {"--size: '10'", "WIDTHxHEIGHT"}},
      {{"render", "quad.gltf", "--size", "65537x1"}, 2, {"--size: width 65537; allowed: [1, 65536]"}},
      {{"render", "quad.gltf", "--size", "60000x60000"},
       2,
       {"--size: 60000 x 60000 = 3600000000 pixels; allowed: max_film_pixels = "}},
      {{"render", "quad.gltf", "--mode", "magic"}, 2, {"--mode: 'magic' is none of", "pt"}},
      {{"render", "quad.gltf", "--variant", "paper"}, 2, {"--variant", "is only valid with --mode adaptive"}},
      {{"render", "quad.gltf", "--integrator", "mlt"},
       2,
       {"--integrator: 'mlt' is none of path, light, bdpt, pt+bdpt, lvc, vcm, photon"}},
      {{"render", "quad.gltf", "--technique", "1,2"},
       2,
       {"--technique: integrator path in mode pt; allowed: integrator bdpt in mode pt"}},
      {{"render", "quad.gltf", "--integrator", "bdpt", "--technique", "1"},
       2,
       {"--technique: '1' is not S,T, two whole numbers with a comma"}},
      {{"render", "quad.gltf", "--integrator", "bdpt", "--technique", "1,2,unweighted"},
       2,
       {"'1,2,unweighted' is not S,T"}},
      {{"render", "quad.gltf", "--integrator", "bdpt", "--technique", "1,,2"}, 2, {"'1,,2' is not S,T"}},
      {{"render", "quad.gltf", "--integrator", "bdpt", "--technique", "-1,3"},
       2,
       {"--technique: light_vertices -1; allowed: [0, 256]"}},
      {{"render", "quad.gltf", "--integrator", "bdpt", "--technique", "2,4000000000"}, 2, {"is not S,T"}},
      {{"render", "quad.gltf", "--integrator", "bdpt", "--technique", "1,1"},
       2,
       {"--technique: light_vertices 1 with camera_vertices 1: lights seen directly come from light_vertices 0"}},
      {{"render", "quad.gltf", "--integrator", "bdpt", "--technique", "3,0"},
       2,
       {"--technique: camera_vertices 0; allowed: [1, 257]"}},
      {{"render", "quad.gltf", "--integrator", "bdpt", "--technique", "3,3", "--max-segments", "4"},
       2,
       {"--technique: light_vertices 3 with camera_vertices 3 is 5 segments; allowed: [1, max_segments = 4]"}},
      {{"render", "quad.gltf", "--integrator", "bdpt", "--technique", "12,1"},
       2,
       {"settings.technique.light_vertices: 12; allowed: [0, 10]"}},
      {{"techniques"}, 2, {"FILE: is missing"}},
      {{"techniques", "quad.gltf", "--max-length", "17"}, 2, {"--max-length: '17'", "[1, 16]"}},
      {{"techniques", "quad.gltf", "--integrator", "light"}, 2, {"--integrator: is not an option of techniques"}},
      {{"techniques", "quad.gltf", "--output", "quad.gltf"}, 2, {"--output: 'quad.gltf' is a file; allowed: a folder"}},
      {{"techniques", "quad.gltf", "--output", "none/here"}, 2, {"--output: the folder 'none' does not exist"}},
      {{"techniques", "quad.gltf", "--samples", "0", "--size", "0x1"}, 2, {"--samples: '0'", "--size: '0x1'"}},
      {{"move", "quad.gltf", "--turn", "5", "--mode", "combined", "--integrator", "vcm"},
       2,
       {"--integrator: vcm in mode combined; allowed there: path, bdpt, pt+bdpt; vcm needs mode pt"}},
      {{"render", "quad.gltf", "--integrator", "lvc", "--connections", "65"}, 2, {"--connections: '65'", "[1, 64]"}},
      {{"render", "quad.gltf", "--integrator", "photon", "--connections", "2"},
       2,
       {"--connections: is only valid with --integrator lvc or vcm"}},
      {{"render", "quad.gltf", "--integrator", "vcm", "--merging-radius", "0"}, 2, {"--merging-radius: '0'"}},
      {{"render", "quad.gltf", "--integrator", "lvc", "--merging-radius", "0.01"},
       2,
       {"--merging-radius: is only valid with --integrator vcm or photon"}},
      {{"render", "quad.gltf", "--integrator", "vcm", "--merging-shrinking", "1"},
       2,
       {"--merging-shrinking: is not an option of render; did you mean --merging-radius?"}},
      {{"render", "quad.gltf", "--roulette", "sqrt"}, 2, {"--roulette: 'sqrt' is none of root, throughput"}},
      {{"render", "quad.gltf", "--integrator", "bdpt", "--max-segments", "257"},
       2,
       {"--integrator: bdpt with max_segments 257; allowed there: [1, 256]"}},
      {{"move", "quad.gltf", "--turn", "5", "--mode", "reproject", "--integrator", "light"},
       2,
       {"--integrator: light in mode reproject (variant bounded); allowed there: path; light in mode pt"}},
      {{"move", "quad.gltf", "--turn", "5", "--mode", "combined", "--variant", "paper", "--integrator", "bdpt"},
       2,
       {"--integrator: bdpt in mode combined (variant paper); allowed there: path"}},
      {{"render", "quad.gltf", "--mode", "adaptive", "--variant", "paper", "--integrator", "light"},
       2,
       {"--integrator: light in mode adaptive (variant paper); allowed there: path"}},
      {{"render", "quad.gltf", "--mode", "adaptive", "--adaptive-min", "7"}, 2, {"--adaptive-min", "is odd"}},
      {{"move", "quad.gltf", "--turn", "5", "--mode", "combined", "--adaptive-min", "7"},
       2,
       {"--adaptive-min", "is odd"}},
      {{"move", "quad.gltf", "--turn", "5", "--mode", "reproject", "--adaptive-min", "8"},
       2,
       {"--adaptive-min", "is only valid with --mode adaptive or combined"}},
      {{"move", "quad.gltf", "--turn", "5", "--mode", "combined", "--stored-hits", "4"},
       2,
       {"--stored-hits", "is only valid with --mode reproject or combined with variant paper"}},
      {{"move", "quad.gltf", "--turn", "5", "--mode", "reproject", "--variant", "paper", "--stored-hits", "2"},
       2,
       {"--stored-hits: 2; allowed: 1, 4"}},
      {{"move", "quad.gltf", "--turn", "5", "--mode", "reproject", "--variant", "paper", "--max-reuse-error", "0"},
       2,
       {"--max-reuse-error: '0'"}},
      {{"render", "quad.gltf", "--layers", "history,bias"}, 2, {"--layers: 'bias' is none of", "history, density"}},
      {{"render", "quad.gltf", "--mode", "adaptive", "--adaptive-max", "64"},
       2,
       {"--adaptive-max: is only valid with --mode adaptive or combined with variant paper"}},
      {{"render", "quad.gltf", "--mode", "adaptive", "--variant", "paper", "--adaptive-min", "8", "--adaptive-max",
        "8"},
       2,
       {"--adaptive-max: 8; allowed: more than min_samples = 8"}},
      {{"render", "quad.gltf", "--seed", "-1"}, 2, {"--seed: '-1'"}},
      {{"render", "quad.gltf", "--max-segments", "0"}, 2, {"--max-segments: '0'", "[1, 65535]"}},
      {{"render", "quad.gltf", "--roulette-from", "65536"}, 2, {"--roulette-from: '65536'", "[1, 65535]"}},
      {{"render", "quad.gltf", "--filter", "mitchell"}, 2, {"--filter: 'mitchell' is none of box, tent, gaussian"}},
      {{"render", "quad.gltf", "--filter", ""}, 2, {"--filter: '' is none of"}},
      {{"render", "quad.gltf", "--filter", "tent:"}, 2, {"--filter: 'tent:': R is not a number in (0, 16]"}},
      {{"render", "quad.gltf", "--filter", "tent:0"}, 2, {"--filter: 'tent:0'", "(0, 16]"}},
      {{"render", "quad.gltf", "--filter", "tent:1:2"}, 2, {"--filter: 'tent:1:2'", "(0, 16]"}},
      {{"render", "quad.gltf", "--filter", "gaussian:nan"}, 2, {"--filter: 'gaussian:nan'", "(0, 16]"}},
      {{"render", "quad.gltf", "--filter", "gaussian:16.5"}, 2, {"--filter: 'gaussian:16.5'", "(0, 16]"}},
      {{"render", "quad.gltf", "--filter", "box:1"}, 2, {"--filter: 'box:1': the box has no R"}},
      {{"render", "quad.gltf", "--threads", "0"}, 2, {"--threads: '0'", "[1, 1024]"}},
      {{"render", "quad.gltf", "--region", "1,1,1,2"}, 2, {"--region: '1,1,1,2'"}},
      {{"render", "quad.gltf", "--size", "8x8", "--region", "0,0,9,8"},
       2,
       {"--region: [0, 9) x [0, 8) is not inside the film [0, 8) x [0, 8)"}},
      {{"render", "quad.gltf", "--region", "0,0,9000,8"},
       2,
       {"--region: [0, 9000) x [0, 8) is not inside the film [0, 1280) x [0, 720)"}},
      {{"render", "quad.gltf", "--environment", "1,2"}, 2, {"--environment: '1,2'"}},
      {{"render", "quad.gltf", "--environment", "1e39,1,1"}, 2, {"--environment: '1e39,1,1'", "[0, 3.4e38]"}},
      {{"render", "quad.gltf", "--environment", "inf,1,1"}, 2, {"--environment: 'inf,1,1'", "[0, 3.4e38]"}},
      {{"render", "quad.gltf", "--environment", "none.exr"}, 2, {"--environment: 'none.exr'"}},
      {{"render", "quad.gltf", "--texture-filter", "mip"}, 2, {"--texture-filter: is not an option of render"}},
      {{"render", "quad.gltf", "--camera", "top"}, 2, {"--camera: 'top' is none of 'front'"}},
      {{"render", "quad.gltf", "--camera", "1"}, 2, {"--camera: '1'", "[0, 0]"}},
      {{"render", "quad.gltf", "--compression", "lzw"}, 2, {"--compression: 'lzw' is none of none, rle"}},
      {{"render", "quad.gltf", "--pixel-type", "int"}, 2, {"--pixel-type: 'int'"}},
      {{"render", "quad.gltf", "--layers", "alpha,beta"}, 2, {"--layers: 'beta'"}},
      {{"render", "quad.gltf", "--output", "none/q.exr"}, 2, {"--output: the folder 'none'"}},
      {{"render", "quad.gltf", "--png", "."}, 2, {"--png: '.' is a folder"}},
      {{"render", "quad.gltf", "--exposure", "65", "--png", "q.png"}, 2, {"--exposure: '65'", "[-64, 64]"}},
      {{"render", "quad.gltf", "--raw"}, 2, {"--raw", "is only valid with --png"}},
      {{"render", "quad.gltf", "--progress", "loud"}, 2, {"--progress: 'loud' is none of auto, always, never"}},
      {{"render", "quad.gltf", "--server", "here"}, 2, {"--server", "'here' is not HOST:PORT"}},
      {{"render", "quad.gltf", "--wait", "3"}, 2, {"--wait: is only valid with --server"}},
      {{"render", "quad.gltf", "--scene-path"}, 2, {"--scene-path: is only valid with --server"}},
      {{"render", "quad.gltf", "--server", "127.0.0.1:1", "--threads", "2"}, 2, {"--threads"}},
      {{"render", "quad.gltf", "--server", "127.0.0.1:1"}, 4, {"no server answers at 127.0.0.1:1"}},
      {{"info", "--server", "127.0.0.1:1"}, 4, {"no server answers at 127.0.0.1:1"}},
      {{"render", "none.gltf"}, 3, {"none.gltf"}},
      {{"scene", "inspect", "none.gltf"}, 3, {"none.gltf"}},
      {{"scene", "inspect"}, 2, {"FILE: is missing"}},
      {{"scene"}, 2, {"subcommand"}},
      {{"scene", "foo"}, 2, {"'foo' is not a command of scene: inspect"}},
      {{"scene", "foo", "quad.gltf"}, 2, {"'foo' is not a command of scene: inspect"}},
      {{"move", "quad.gltf"}, 2, {"--path: or one of --turn, --orbit, --move is required"}},
      {{"move", "quad.gltf", "--turn", "5", "--play", "0"}, 2, {"--play: '0'", "240"}},
      {{"move", "quad.gltf", "--turn", "5", "--preview-rate", "121"}, 2, {"--preview-rate: '121'", "[0, 120]"}},
      {{"move", "quad.gltf", "--turn", "5", "--preview-budget", "4"}, 2, {"--preview-budget: '4'", "[5, 1000]"}},
      {{"move", "quad.gltf", "--turn", "5", "--preview-jpeg", "0"}, 2, {"--preview-jpeg: '0'", "[1, 100]"}},
      {{"move", "quad.gltf", "--turn", "left"}, 2, {"--turn: 'left'"}},
      {{"move", "quad.gltf", "--turn", "5", "--steps", "0"}, 2, {"--steps: '0'", "[1, 100000]"}},
      {{"move", "quad.gltf", "--turn", "5", "--path", "p.json"}, 2, {"--path", "does not go with --turn"}},
      {{"move", "quad.gltf", "--turn", "5", "--pivot", "1,2,3"}, 2, {"--pivot: is only valid with --orbit"}},
      {{"move", "quad.gltf", "--foveation", "paper", "--preview-upscaling"},
       2,
       {"--foveation: paper is only valid with --preview-rate above 0, or with --play",
        "--preview-upscaling: is only valid with --preview-rate above 0, or with --play"}},
      {{"move", "quad.gltf", "--play", "30", "--preview-rate", "0", "--preview-budget", "20", "--preview-jpeg", "90"},
       2,
       {"--preview-budget: is only valid with --preview-rate above 0", "--preview-jpeg: is only valid with"}},
      {{"move", "quad.gltf", "--path", "turn", "--orbit", "5"}, 2, {"--path", "does not go with --turn, --orbit and"}},
      {{"move", "quad.gltf", "--path", "turn", "--step", "0"}, 2, {"--path", "step: 0 is not a number of degrees"}},
      {{"move", "quad.gltf", "--path", "zoom", "--step", "1"}, 2, {"--path", "step: 1 is not a magnification"}},
      {{"move", "quad.gltf", "--path", "jump", "--step", "400"}, 2, {"--step", "[-360, 360]"}},
      {{"move", "quad.gltf", "--path", "jump", "--steps", "0"}, 2, {"--steps", "[1, 100000]"}},
      {{"move", "quad.gltf", "--path", "none.json", "--step", "2"}, 2, {"--step", "with a --path by name"}},
      {{"move", "quad.gltf", "--path", "."}, 2, {"--path: '.' is a folder"}},
      {{"move", "quad.gltf", "--path", "none.json"}, 2, {"--path: 'none.json' cannot be opened, and is none of turn,"}},
      {{"render", "quad.gltf", "--shard", "0/2"}, 2, {"--shard: '0/2' is not I/N", "[1, 4096]"}},
      {{"submit", "quad.gltf"}, 2, {"--server: is missing", "HELIOGRAPH_SERVER"}},
      {{"jobs", "--server", "here"}, 2, {"--server: 'here'"}},
      {{"jobs", "--server", "127.0.0.1:1"}, 4, {"no server answers at 127.0.0.1:1"}},
      {{"jobs", "--server", "127.0.0.1:1", "--state", "done"}, 2, {"--state: 'done' is none of queued, running, paused"}},
      {{"jobs", "--server", "127.0.0.1:1", "--limit", "0"}, 2, {"--limit: '0'", "[1, 1000000]"}},
      {{"jobs", "--server", "127.0.0.1:1", "--threads", "2"}, 2, {"--threads: is not an option of jobs"}},
      {{"submit", "quad.gltf", "--server", "127.0.0.1:1", "--priority", "101"}, 2, {"--priority: '101'", "[-100, 100]"}},
      {{"submit", "quad.gltf", "--server", "127.0.0.1:1", "--overwrite"}, 2, {"only valid with --output-on-server"}},
      {{"submit", "quad.gltf", "--server", "127.0.0.1:1", "--output-on-server", "x.png"}, 2, {"does not end in .exr"}},
      {{"submit", "quad.gltf", "--server", "127.0.0.1:1", "--name", "a\tb"}, 2, {"--name: has 3 bytes, control"}},
      {{"job", "--server", "127.0.0.1:1"}, 2, {"ID: is missing"}},
      {{"job", "j-1", "--server", "127.0.0.1:1", "--pause", "--cancel"}, 2, {"exclude each other"}},
      {{"job", "j-1", "--server", "127.0.0.1:1", "--view", "1"}, 2, {"--view: is only valid with --fetch"}},
      {{"job", "j-1", "--server", "127.0.0.1:1", "--fetch", "no/x.exr"}, 2, {"--fetch: the folder 'no' does not exist"}},
      {{"top", "--server", "127.0.0.1:1", "--interval", "0"}, 2, {"--interval: '0'", "[0.1, 3600]"}},
      {{"merge", "-o", "x.exr"}, 2, {"PART.exr: is missing"}},
      {{"merge", "a.exr"}, 2, {"--output: is missing"}},
      {{"merge", "a.exr", "-o", "x.exr"}, 1, {"a.exr: cannot be read"}},
      {{"merge", "quad.gltf", "-o", "quad.gltf"}, 2, {"--output: 'quad.gltf' is a part, which must not be"}},
  };
  // A start of the program takes a third of a second.
  const std::size_t step = by_tier<std::size_t>(3, 1);
  for (std::size_t i = 0; i < lines.size(); i += step) expect_refused(lines[i], heliograph(lines[i].arguments));
}

TEST_F(CliBadInput, AllProblemsAtOnce) {
  const ProcessResult result = heliograph({"render", "--samples", "0", "--size", "3", "--foo", "--mode", "magic"});
  EXPECT_EQ(result.exit_code, 2);
  expect_one_line(result.err);
  for (const char* part : {"FILE", "--samples", "--size", "--foo", "--mode"}) {
    EXPECT_NE(result.err.find(part), std::string::npos) << part << ": " << result.err;
  }
}

TEST_F(CliBadInput, AllProblemsOfValuesAtOnce) {
  expect_refused({{}, 2, {"--size: '0x0'", "--environment: '1,nan,2' is not R,G,B", "[0, 3.4e38]"}},
                 heliograph({"render", "quad.gltf", "--size", "0x0", "--environment", "1,nan,2"}));
}

TEST_F(CliBadInput, NothingThatIsReadIsOverwritten) {
  write_file(folder_ / "bundle/room.gltf", R"({"asset": {"version": "2.0"}, "buffers": [{"uri": "room.bin"}]})");
  write_file(folder_ / "bundle/room.bin", "bytes");
  write_file(folder_ / "sky.exr", "a map");
  write_file(folder_ / "path.json", R"({"views": [{"turn_degrees": 5, "repeat": 12}]})");
  std::filesystem::copy_file(folder_ / "path.json", folder_ / "p.0003.json");
  std::filesystem::create_symlink("quad.gltf", folder_ / "link.exr");
  std::filesystem::create_hard_link(folder_ / "quad.gltf", folder_ / "v.0007.exr");
  std::filesystem::create_hard_link(folder_ / "sky.exr", folder_ / "quad.exr");
  std::filesystem::create_directory_symlink("bundle", folder_ / "other");
  std::filesystem::create_symlink(folder_.path(), folder_ / "again");
  std::map<std::string, std::string> before;
  const char* const read[] = {"quad.gltf", "bundle/room.gltf", "bundle/room.bin",
                              "sky.exr",   "p.0003.json",      "v.0007.exr"};
  for (const char* name : read) before[name] = read_file(folder_ / name);

  const std::vector<BadLine> lines = {
      {{"render", "quad.gltf", "--output", "quad.gltf"}, 2, {"--output: 'quad.gltf' is the scene"}},
      {{"render", "quad.gltf", "--output", "./again/quad.gltf"}, 2, {"--output", "is the scene"}},
      {{"render", "quad.gltf", "--output", "link.exr"}, 2, {"--output: 'link.exr' is the scene"}},
      {{"render", "bundle/room.gltf", "--png", "other/room.bin"},
       2,
       {"--png: 'other/room.bin' is a file of the scene"}},
      {{"render", "quad.gltf", "--environment", "sky.exr", "--heatmap", "sky.exr"},
       2,
       {"--heatmap: 'sky.exr' is the e"}},
      // The name that --output has when it is not given.
      {{"render", "quad.gltf", "--environment", "sky.exr"}, 2, {"--output: 'quad.exr' is the environment map"}},
      {{"render", "quad.gltf", "--output", "lay.exr", "--png", "again/lay.exr", "--heatmap", "lay.exr"},
       2,
       {"--png: 'again/lay.exr' is written by --output too", "--heatmap: 'lay.exr' is written by --output too"}},
      {{"render", "quad.gltf", "--mode", "combined", "--heatmap", "h.png", "--png", "h.reuse.png"},
       2,
       {"--heatmap: 'h.reuse.png' is written by --png too"}},
      {{"render", "quad.gltf", "--output", "quad.gltf", "--samples", "0"}, 2, {"is the scene", "--samples: '0'"}},
      {{"move", "quad.gltf", "--turn", "5", "--png", "a.#.exr", "--output", "a.#.exr"}, 2, {"--png", "'a.0.exr'"}},
      {{"move", "quad.gltf", "--path", "path.json", "--output", "v.exr"}, 2, {"--output: 'v.0007.exr' is the scene"}},
      {{"move", "quad.gltf", "--path", "p.0003.json", "--png", "p.json"},
       2,
       {"--png: 'p.0003.json' is the camera path"}},
      // View 10 of the one is view 0 of the other.
      {{"move", "quad.gltf", "--path", "path.json", "--output", "s#.exr", "--png", "s1#.exr"},
       2,
       {"'s10.exr' is written by --png too"}},
  };
  for (const BadLine& line : lines) expect_refused(line, heliograph(line.arguments));
  for (const char* name : read) EXPECT_EQ(read_file(folder_ / name), before[name]) << name;
  EXPECT_FALSE(exists("lay.exr"));
}

TEST_F(CliBadInput, WithJsonTheErrorIsJsonToo) {
  const auto usage = heliograph_json({"render", "quad.gltf", "--samples", "0"}, 2);
  EXPECT_EQ(usage["exit_code"], 2);
  EXPECT_NE(usage["error"].get<std::string>().find("--samples"), std::string::npos);
  write_file(folder_ / "broken.gltf", "{\"asset\": ");
  const auto refused = heliograph_json({"scene", "inspect", "broken.gltf"}, 3);
  EXPECT_NE(refused["error"].get<std::string>().find("broken.gltf"), std::string::npos);
}

TEST_F(CliBadInput, BrokenScenesAreRefusedWithTheirPlace) {
  write_file(folder_ / "empty.glb", "");
  write_file(folder_ / "text.gltf", "hello");
  write_file(folder_ / "short.glb", std::string("glTF\x02\0\0\0\xff\0\0\0", 12));
  write_file(folder_ / "needs.gltf", R"({"asset": {"version": "2.0"}, "extensionsRequired": ["EXT_unheard_of"],
    "extensionsUsed": ["EXT_unheard_of"]})");
  write_file(folder_ / "escapes.gltf",
             R"({"asset": {"version": "2.0"}, "buffers": [{"uri": "../x.bin", "byteLength": 4}],
    "bufferViews": [{"buffer": 0, "byteLength": 4}], "images": [{"uri": "/etc/hostname"}]})");
  for (const char* name : {"empty.glb", "text.gltf", "short.glb", "needs.gltf", "escapes.gltf"}) {
    const ProcessResult result = heliograph({"scene", "inspect", name});
    EXPECT_EQ(result.exit_code, 3) << name << ": " << result.err;
    expect_one_line(result.err);
  }
  EXPECT_NE(heliograph({"scene", "inspect", "needs.gltf"}).err.find("EXT_unheard_of"), std::string::npos);
}

TEST_F(CliBadInput, ABrokenPathNamesThePlace) {
  write_file(folder_ / "path.json", R"({"views": [{"turn_degrees": "left"}]})");
  const ProcessResult result = heliograph({"move", "quad.gltf", "--path", "path.json"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("path.json/views/0/turn_degrees"), std::string::npos) << result.err;
  write_file(folder_ / "huge.json", R"({"views":[{"fov_degrees":1e400}]})");
  expect_refused({{"move", "quad.gltf", "--path", "huge.json"}, 2, {"huge.json@", "number overflow parsing '1e400'"}},
                 heliograph({"move", "quad.gltf", "--path", "huge.json"}));
}

}  // namespace
}  // namespace helio::test
