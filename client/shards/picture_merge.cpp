#include "client/shards/picture_merge.h"

#include <google/protobuf/util/message_differencer.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <set>
#include <utility>

#include "client/shards/picture_origin.h"

namespace helio {

namespace pb = heliograph::v1;

namespace {

using google::protobuf::util::MessageDifferencer;

constexpr std::uint64_t kMostPixels = std::uint64_t(1) << 32;
constexpr int kMostProblems = 8;  // of one kind that are told

struct Placed {
  const PicturePart* part;
  RowRange rendered;
};

RowRange window_rows(const PicturePart& part) {
  return {part.picture.header.data_window.y0, part.picture.header.data_window.y1};
}

// What parts of one picture have in common.
pb::PictureOrigin common_origin(const pb::PictureOrigin& origin, const MergeOptions& options) {
  pb::PictureOrigin common = origin;
  common.mutable_settings()->clear_region();
  common.mutable_budget()->clear_bytes_per_second();  // ends nothing
  common.mutable_budget()->clear_error_measure();     // no choice any more
  if (!options.mix) return common;
  common.clear_build();
  common.clear_isa();
  common.clear_mixed_builds();
  return common;
}

// "settings.seed: 1 -> 2" of every field that differs.
std::string differences(const pb::PictureOrigin& a, const pb::PictureOrigin& b) {
  MessageDifferencer differencer;
  std::string text;
  differencer.ReportDifferencesToString(&text);
  if (differencer.Compare(a, b)) return {};
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ',');
  return text;
}

// A part alone: what it was rendered with must be the same in parts as in the whole.
void check_part(const PicturePart& part, const MergeOptions& options, Problems& problems) {
  const pb::PictureOrigin& origin = part.origin;
  const TileHeader& header = part.picture.header;
  if (const std::string reason = no_shards_reason(origin.settings(), origin.budget()); !reason.empty())
    problems.add(part.file, "a part of a picture " + reason);
  if (origin.ended_by() != pb::END_REASON_SAMPLES)
    problems.add(part.file, fmt::format("was not rendered to its end: {} of {} samples", origin.samples_per_pixel(),
                                        origin.budget().samples()));
  if (origin.mixed_builds() && !options.mix)
    problems.add(part.file, "was rendered by different builds or instruction paths, one after the other (--mix)");
  const pb::RenderSettings& settings = origin.settings();
  if (header.frame_width != settings.width() || header.frame_height != settings.height()) {
    problems.add(part.file, fmt::format("is of a picture of {}x{}, and says {}x{}", header.frame_width,
                                        header.frame_height, settings.width(), settings.height()));
  } else if (header.data_window.x0 != 0 || header.data_window.x1 != header.frame_width) {
    problems.add(part.file, fmt::format("has columns [{}, {}) of {}; allowed: whole rows", header.data_window.x0,
                                        header.data_window.x1, header.frame_width));
  }
  for (const std::string& name : part.picture.names) {
    if (name.starts_with("display."))
      problems.add(part.file, "has the layer " + name + ", which looks further than a part's margin");
  }
}

void check_common(const std::vector<PicturePart>& parts, const MergeOptions& options, Problems& problems) {
  const PicturePart& first = parts.front();
  const pb::PictureOrigin wanted = common_origin(first.origin, options);
  for (const PicturePart& part : parts) {
    const std::string differ = differences(wanted, common_origin(part.origin, options));
    if (!differ.empty()) problems.add(part.file, fmt::format("differs from {}: {}", first.file, differ));
    if (part.picture.names != first.picture.names) problems.add(part.file, "has other channels than " + first.file);
    if (part.picture.header.comments != first.picture.header.comments)
      problems.add(part.file, "has another comment than " + first.file);
  }
}

// The division that all parts are of: the one with the fewest parts. Both halves of 32 rows have all rows, with their
// margins, so a part is the next one that it may be, unless it may `repeat` one.
std::optional<std::vector<Shard>> find_division(const std::vector<Placed>& parts, int height, bool repeat) {
  for (int count = 1; count <= most_shards(height); ++count) {
    std::vector<Shard> shards;
    int number = 1;
    for (const Placed& placed : parts) {
      while (number <= count && rendered_rows({number, count}, height) != placed.rendered) ++number;
      if (number > count) break;
      shards.push_back({number, count});
      if (!repeat) ++number;
    }
    if (shards.size() == parts.size()) return shards;
  }
  return std::nullopt;
}

void check_division(const std::vector<Placed>& parts, const std::vector<Shard>& shards, int height,
                    Problems& problems) {
  std::set<int> there;
  for (std::size_t i = 0; i < shards.size(); ++i) {
    if (!there.insert(shards[i].number).second) {
      problems.add(parts[i].part->file, fmt::format("has the same rows as {}: both are part {}",
                                                    parts[i - 1].part->file, to_string(shards[i])));
    }
  }
  int missing = 0;
  const int count = shards.front().count;
  for (int number = 1; number <= count; ++number) {
    if (there.contains(number) || ++missing > kMostProblems) continue;
    problems.add("part " + to_string(Shard{number, count}),
                 fmt::format("is missing: rows {}", to_string(rows_of(Shard{number, count}, height))));
  }
  if (missing > kMostProblems)
    problems.add("parts", fmt::format("{} of {} are missing, the first of them named", missing, count));
}

std::string describe(const std::vector<Placed>& parts) {
  std::string text;
  for (std::size_t i = 0; i < parts.size() && i < std::size_t(kMostProblems); ++i)
    text += fmt::format("{}{} {}", i > 0 ? ", " : "", to_string(parts[i].rendered), parts[i].part->file);
  return parts.size() > std::size_t(kMostProblems) ? text + ", ..." : text;
}

bool reads_neighbours(const std::string& channel) {
  return channel.starts_with("variance.");
}

// Rows that two parts have. The outermost ones of a part have another variance, for what it is made of is missing.
Result<int> check_overlap(const Placed& upper, const Placed& lower) {
  constexpr int kReach = 3;
  const int width = upper.part->picture.header.frame_width;
  const RowRange rows{lower.rendered.first, upper.rendered.end};
  for (std::size_t channel = 0; channel < upper.part->picture.names.size(); ++channel) {
    const std::string& name = upper.part->picture.names[channel];
    const int reach = reads_neighbours(name) ? kReach : 0;
    for (int y = rows.first + reach; y < rows.end - reach; ++y) {
      const auto row = [&](const Placed& placed) {
        return placed.part->picture.channels[channel].data() +
               std::size_t(y - placed.rendered.first) * std::size_t(width);
      };
      const float *a = row(upper), *b = row(lower);
      if (std::memcmp(a, b, std::size_t(width) * sizeof(float)) == 0) continue;
      int x = 0;
      while (std::memcmp(a + x, b + x, sizeof(float)) == 0) ++x;
      return Error{ErrorCode::invalid_argument,
                   fmt::format("and {} differ at pixel ({}, {}) of {}, which both have: {} and {}", lower.part->file, x,
                               y, name, a[x], b[x]),
                   upper.part->file};
    }
  }
  return rows.end - rows.first;
}

}  // namespace

Result<PicturePart> read_part(const std::string& file) {
  auto picture = read_exr(file, kMostPixels);
  if (!picture) return picture.error();
  auto origin = read_origin(picture->header.origin);
  if (!origin) return Error{ErrorCode::invalid_argument, origin.error().to_string(), file};
  return PicturePart{file, std::move(*picture), std::move(*origin)};
}

Result<MergedPicture> merge_parts(std::vector<PicturePart> parts, const MergeOptions& options) {
  Problems problems;
  if (parts.empty()) problems.add("PART.exr", "none is given");
  for (const PicturePart& part : parts) check_part(part, options, problems);
  if (problems.empty()) check_common(parts, options, problems);
  if (!problems.empty()) return problems.to_error();

  std::vector<Placed> placed;
  for (const PicturePart& part : parts) placed.push_back({&part, window_rows(part)});
  std::stable_sort(placed.begin(), placed.end(), [](const Placed& a, const Placed& b) {
    return std::pair(a.rendered.first, a.rendered.end) < std::pair(b.rendered.first, b.rendered.end);
  });
  const TileHeader& first = parts.front().picture.header;
  const int height = first.frame_height;
  auto shards = find_division(placed, height, false);
  if (!shards) shards = find_division(placed, height, true);
  if (!shards) {
    return Error{ErrorCode::invalid_argument,
                 "are not the parts of one division of " + std::to_string(height) + " rows, as --shard I/N makes them",
                 "rows " + describe(placed)};
  }
  check_division(placed, *shards, height, problems);
  if (!problems.empty()) return problems.to_error();

  MergedPicture merged;
  for (const Placed& part : placed) merged.files.push_back(part.part->file);
  merged.shards = *shards;
  for (std::size_t i = 0; i + 1 < placed.size() && !options.mix; ++i) {
    const auto checked = check_overlap(placed[i], placed[i + 1]);
    if (!checked) return checked.error();
    merged.checked_rows += *checked;
  }
  merged.origin = parts.front().origin;
  merged.origin.mutable_settings()->clear_region();
  for (const PicturePart& part : parts) {
    if (part.origin.build() != merged.origin.build() || part.origin.isa() != merged.origin.isa() ||
        part.origin.mixed_builds())
      merged.origin.set_mixed_builds(true);
  }
  merged.picture.header = {
      {0, 0, first.frame_width, height}, first.frame_width, height, first.comments, write_origin(merged.origin)};
  merged.picture.names = parts.front().picture.names;
  const auto width = std::size_t(first.frame_width);
  for (std::size_t channel = 0; channel < merged.picture.names.size(); ++channel) {
    std::vector<float>& out = merged.picture.channels.emplace_back(width * std::size_t(height));
    for (std::size_t i = 0; i < placed.size(); ++i) {
      const RowRange own = rows_of((*shards)[i], height);
      const float* from =
          placed[i].part->picture.channels[channel].data() + std::size_t(own.first - placed[i].rendered.first) * width;
      std::copy_n(from, std::size_t(own.end - own.first) * width, out.data() + std::size_t(own.first) * width);
    }
  }
  return merged;
}

}  // namespace helio
