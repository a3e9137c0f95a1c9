// heliograph merge: the parts of a picture, put together.
#include <spdlog/fmt/fmt.h>

#include <memory>

#include "client/cli/command.h"
#include "client/cli/commands/output_check.h"
#include "client/cli/commands/picture_files.h"
#include "client/cli/exit_code.h"
#include "client/shards/picture_merge.h"

namespace helio::cli {

namespace pb = heliograph::v1;

namespace {

struct MergeCommandOptions {
  std::vector<std::string> parts;
  TextOption output;
  bool mix = false;
  bool json = false;
};

constexpr const char* kHelp =
    "Parts are what --shard I/N of heliograph render and heliograph submit made, all N of them, in any order. The\n"
    "picture has the bits that the render of the whole has, in every channel: radiance, variance and samples, and the\n"
    "layers alpha, depth, normal, albedo, history and density. The layer display cannot be rendered in parts.\n"
    "What differs in scene, camera, settings, seed, samples or build is refused, each by name; so are rows that are\n"
    "missing or there twice. Rows that two parts have, their margins, are compared bit for bit before one is dropped.\n"
    "With --json, stdout holds one object: output, width, height, samples, parts: [{file, shard, first_row,\n"
    "end_row}], checked_rows (that two parts had), mixed_builds.\n"
    "Example: heliograph merge room.1.exr room.2.exr -o room.exr\n\n";

int run(const CLI::App& app, const MergeCommandOptions& options) {
  Terminal terminal(options.json);
  Problems problems;
  OptionReader reader(problems);
  if (options.parts.empty()) problems.add("PART.exr", "is missing: the parts to put together");
  const std::string output = reader.output_file(options.output).value_or("");
  if (!options.output.given()) reader.problem(options.output, "is missing: the file to write");
  check_exr_name("--output", output, {}, problems);
  report_unknown(app, reader);
  OutputCheck outputs;
  for (const std::string& part : options.parts) outputs.add_input(part, "a part");
  if (!output.empty()) outputs.check("--output", output, problems);
  if (!problems.empty()) return terminal.fail(kUsage, problems.to_error().message);

  std::vector<PicturePart> parts;
  for (const std::string& file : options.parts) {
    terminal.progress("reading " + file);
    auto part = read_part(file);
    if (!part) problems.add("", part.error().to_string());
    if (part) parts.push_back(std::move(*part));
  }
  terminal.end_progress();
  if (!problems.empty()) return terminal.fail(kFailed, problems.to_error().message);
  const auto merged = merge_parts(std::move(parts), {options.mix});
  if (!merged) return terminal.fail(kFailed, merged.error().to_string());
  const DecodedTile& picture = merged->picture;
  const Status written = write_picture(output, picture.header, picture.names, picture.channels);
  if (!written) return terminal.fail(kFailed, written.error().to_string());

  Json json;
  json["output"] = output;
  json["width"] = picture.header.frame_width;
  json["height"] = picture.header.frame_height;
  json["samples"] = merged->origin.samples_per_pixel();
  json["parts"] = Json::array();
  for (std::size_t i = 0; i < merged->files.size(); ++i) {
    const RowRange rows = rows_of(merged->shards[i], picture.header.frame_height);
    json["parts"].push_back({{"file", merged->files[i]},
                             {"shard", to_string(merged->shards[i])},
                             {"first_row", rows.first},
                             {"end_row", rows.end}});
  }
  json["checked_rows"] = merged->checked_rows;
  json["mixed_builds"] = merged->origin.mixed_builds();
  if (merged->origin.mixed_builds())
    terminal.warn("the parts come from different builds or instruction paths: bits may differ from the whole's");
  terminal.say(fmt::format("{}: {}x{}, {} samples, of {} parts; {} rows that two parts have are equal", output,
                           picture.header.frame_width, picture.header.frame_height, merged->origin.samples_per_pixel(),
                           merged->files.size(), merged->checked_rows));
  terminal.result(json);
  return kOk;
}

}  // namespace

Command add_merge(CLI::App& root) {
  CLI::App* app = add_command(root, "merge", "Put the parts of a picture together, with the bits of the whole",
                              std::string(kHelp) + kExitCodesHelp);
  auto options = std::make_shared<MergeCommandOptions>();
  add_words(*app, options->parts, "PART.exr", "Parts of one picture, all of them, in any order. Required");
  add_text(*app, options->output, "--output,-o", "WHOLE.exr",
           "The picture, as float. Required; a file that is there is replaced");
  add_flag(*app, options->mix, "--mix",
           "Also put parts of different builds or instruction paths together; bits may then differ from the whole's");
  add_flag(*app, options->json, "--json", "One JSON object on stdout, described below");
  allow_unknown(*app);
  return {app, [app, options] { return run(*app, *options); }};
}

}  // namespace helio::cli
