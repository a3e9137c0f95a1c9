#include "server/compare/comparison.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <future>
#include <limits>
#include <random>
#include <utility>

#include "renderer/base/clock.h"
#include "renderer/codec/checksum.h"
#include "renderer/codec/tile_codec.h"
#include "renderer/metrics/check_pictures.h"
#include "server/base/build_info.h"
#include "server/compare/brightest_sample.h"
#include "server/compare/compare_table.h"
#include "server/compare/rendered_reference.h"
#include "server/sessions/replay_token.h"
#include "server/stream/convert.h"
#include "server/stream/settings_messages.h"

namespace helio {
namespace {

constexpr double kDisturbed = 0.05;
constexpr double kMostHold = 10;  // seconds that others wait for a turn
constexpr double kProgress = 0.25;
constexpr int kRowsPerTile = 64;  // of a picture: 1280 x 64 pixels of three floats are 1 MB
constexpr std::uint64_t kTileBytes = 1 << 20;

constexpr std::size_t kMostProblems = 20;
// The prepared references of FLIP take at most so many bytes in a comparison, and a kFlipShare-th of the memory that is
// left: they save less than half of FLIP's time, and no session is to be refused for them.
constexpr std::uint64_t kMostFlipBytes = std::uint64_t(256) << 20, kFlipShare = 4;

// Of the motion of one view.
std::uint64_t positions_bytes(const ComparisonRequest& request) {
  return request.flicker ? 2 * sizeof(float) * std::uint64_t(request.width()) * std::uint64_t(request.height()) : 0;
}

// Of the mean of two independent halves: a quarter of their squared difference, pixel by pixel, so that errors less
// this variance are those by the halves, of every part of the picture. Of its own pixel it says next to nothing.
Picture variance_of(const ReferencePicture& reference) {
  if (reference.variance) return *reference.variance;
  if (!reference.half_a || !reference.half_b) return {};
  Picture variance(reference.mean.width, reference.mean.height);
  for (int c = 0; c < 3; ++c) {
    const auto &a = reference.half_a->channels[c], &b = reference.half_b->channels[c];
    for (std::size_t i = 0; i < a.size(); ++i) {
      const double difference = double(a[i]) - double(b[i]);
      variance.channels[c][i] =
          float(std::min(0.25 * difference * difference, double(std::numeric_limits<float>::max())));
    }
  }
  return variance;
}

// Of no unit that is done.
std::uint32_t call_number(const std::vector<pb::CompareUnit>& done) {
  std::random_device random;
  for (;;) {
    const std::uint32_t call = random();
    const bool used =
        std::any_of(done.begin(), done.end(), [call](const pb::CompareUnit& unit) { return unit.call() == call; });
    if (call != 0 && !used) return call;
  }
}

Error gone() {
  return {ErrorCode::cancelled, "the caller gave up", {}};
}

constexpr unsigned bit(Measure measure) {
  return 1u << unsigned(measure);
}
constexpr unsigned kHdr = bit(Measure::hdr_flip) | bit(Measure::hdr_flip_median);

void subtract(const Picture& picture, const Picture& reference, Picture& error) {
  error = Picture(picture.width, picture.height);
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < error.channels[c].size(); ++i)
      error.channels[c][i] = picture.channels[c][i] - reference.channels[c][i];
  }
}

// NaN and infinity come from broken samples alone, which films leave out; display layers are finite, too.
Status check_finite(const Picture& picture) {
  for (const auto& channel : picture.channels) {
    if (!all_finite(channel.data(), channel.size()))
      return Error{ErrorCode::internal, "the picture has a value that is not finite", {}};
  }
  return ok_status();
}

}  // namespace

Comparison::Comparison(const RenderContext::Resources& resources, ReferenceStore& references,
                       std::shared_ptr<const LoadedScene> scene, ComparisonRequest request)
    : resources_(resources),
      references_(references),
      scene_(std::move(scene)),
      request_(std::move(request)),
      started_s_(now_s()),
      call_(call_number(request_.done)),
      units_(request_.done) {
  for (const CameraPose& view : request_.views)
    views_.emplace_back().camera = fitted(view, request_.width(), request_.height());
  for (const pb::CompareUnit& unit : units_) done_.emplace(unit.mode(), unit.seed_number(), unit.budget(), unit.view());
  came_done_ = done_.size();
}

pb::CompareResponse::Accepted Comparison::accepted() const {
  pb::CompareResponse::Accepted message;
  for (const ComparedMode& mode : request_.modes) *message.add_modes() = to_message(mode);
  for (const CameraPose& view : request_.views) *message.add_views() = to_message(view);
  message.set_units(std::uint32_t(request_.units()));
  message.set_units_done(std::uint32_t(came_done_));
  message.set_version(build_version());
  message.set_build(build_description());
  message.set_isa(rendering_isa());
  message.set_threads(resources_.engine.threads());
  std::set<std::string> notices;
  for (const CameraPose& view : request_.views)
    notices.insert(aspect_notice(view, request_.width(), request_.height()));
  for (const std::string& notice : notices) {
    if (!notice.empty()) message.add_notices(notice);
  }
  return message;
}

Status Comparison::run(const CancelToken& cancel, const Send& send) {
  cancel_ = &cancel;
  send_ = &send;
  if (cancel.cancelled()) return gone();
  auto memory = resources_.memory.reserve_with_room(picture_bytes(request_.width(), request_.height(), 6),
                                                    "the pictures of a comparison", MemoryOwner::pictures);
  if (!memory) return memory.error();
  bool pictures = sends_pictures({});
  for (const ComparedMode& mode : request_.modes) pictures |= sends_pictures(mode.name);
  if (done_.size() < request_.units() || pictures) {
    if (const Status fits = check_memory(); !fits.ok()) return fits;
    if (const Status found = find_references(); !found.ok()) return found;
  }
  // In turns, each round begun by another mode, so that what drifts (heat, other programs) hits all alike.
  const std::size_t modes = request_.modes.size();
  const std::uint32_t scripts = request_.path() ? std::uint32_t(request_.budgets.size()) : 1;
  for (std::uint32_t seed = 1; seed <= request_.seeds; ++seed) {
    for (std::uint32_t script = 0; script < scripts; ++script) {
      for (std::size_t turn = 0; turn < modes; ++turn) {
        const ComparedMode& mode = request_.modes[(turn + seed - 1 + script) % modes];
        const Status played = request_.path() ? play_path(mode, seed, script) : play_still(mode, seed);
        if (!played.ok()) return played;
      }
    }
  }
  std::vector<ComparedUnit> units;
  for (const pb::CompareUnit& unit : units_) units.push_back(unit_of(unit));
  pb::CompareResponse response;
  pb::CompareResponse::Result& result = *response.mutable_result();
  *result.mutable_table() = to_message(compare_units(script_of(request_), units));
  result.set_seconds(now_s() - started_s_);
  result.set_rendering_seconds(rendering_seconds_);
  result.set_disturbed(std::any_of(units_.begin(), units_.end(), [](const auto& unit) { return unit.disturbed(); }));
  return tell(response);
}

Status Comparison::tell(const pb::CompareResponse& response) {
  return (*send_)(response) ? ok_status() : Status(gone());
}

void Comparison::tell_progress(const std::string& doing, const Turn& turn, double samples, double error) {
  if (gone_ || now_s() - told_progress_s_ < kProgress) return;
  told_progress_s_ = now_s();
  pb::CompareResponse response;
  pb::CompareResponse::Progress& progress = *response.mutable_progress();
  progress.set_units_done(std::uint32_t(done_.size()));
  progress.set_units(std::uint32_t(request_.units()));
  progress.set_doing(doing);
  progress.set_view(turn.view);
  progress.set_seed_number(turn.mode ? turn.seed_number : 0);
  progress.set_budget(turn.budget);
  progress.set_samples(samples);
  progress.set_error(error);
  progress.set_seconds(now_s() - started_s_);
  gone_ = !(*send_)(response);
}

Status Comparison::take_loaded_references() {
  const auto& loaded = request_.reference.loaded;
  Problems problems;
  bool missing = false;
  for (std::size_t v = 0; v < loaded.size(); ++v) {
    const std::string where = fmt::format("reference.loaded.reference_ids[{}]", v);
    const auto& reference = views_[v].reference = references_.find(loaded[v]);
    if (!reference) {
      missing = true;
      problems.add(where,
                   fmt::format("no reference '{}'{}; load it again", loaded[v].substr(0, 64),
                               references_.was_let_go(loaded[v]) ? " is kept any more (max_reference_memory)" : ""));
    } else if (reference->mean.width != request_.width() || reference->mean.height != request_.height()) {
      problems.add(where, fmt::format("{} x {} pixels; allowed: {} x {}, those of the modes", reference->mean.width,
                                      reference->mean.height, request_.width(), request_.height()));
    }
    if (problems.size() >= kMostProblems) break;
  }
  if (problems.empty()) return ok_status();
  return problems.to_error(missing ? ErrorCode::not_found : ErrorCode::invalid_argument);
}

// Before anything is rendered: a path must not find out halfway that its references do not fit.
Status Comparison::check_memory() const {
  std::uint64_t bytes = 0;
  const std::uint64_t a_view = picture_bytes(request_.width(), request_.height(), 3) + positions_bytes(request_);
  for (const ViewState& view : views_) bytes += view.reference ? positions_bytes(request_) : a_view;
  if (bytes <= resources_.memory.obtainable()) return ok_status();
  return Error{ErrorCode::resource_exhausted,
               fmt::format("max_memory: {} bytes are needed for the references of {} views; {} can be had", bytes,
                           views_.size(), resources_.memory.obtainable()),
               {}};
}

bool Comparison::sends_pictures(const std::string& mode) const {
  for (std::uint32_t view = 0; view < views_.size(); ++view) {
    if (request_.sends(mode, view)) return true;
  }
  return false;
}

Status Comparison::prepare_flip(ViewState& view) {
  const unsigned measures = request_.errors.measures;
  const FlipReference::Uses uses{.ldr = (measures & (bit(Measure::flip) | bit(Measure::flip_median))) != 0,
                                 .hdr = (measures & kHdr) != 0};
  // With a single picture to measure nothing would be saved.
  if ((!uses.ldr && !uses.hdr) || request_.units() < done_.size() + 2 * views_.size()) return ok_status();
  FlipOptions options;
  options.threads = std::clamp(resources_.engine.threads(), 1, 64);
  options.cancel = cancel_;
  auto flip = FlipReference::create(view.reference->mean.view(), uses, options);
  if (!flip) return flip.error();
  std::uint64_t held = 0;
  for (const ViewState& other : views_) held += other.flip_memory.bytes();
  const std::uint64_t most = std::min(kMostFlipBytes - held, resources_.memory.available() / kFlipShare);
  auto memory = resources_.memory.reserve(std::min(most, flip->bytes()), "the references of FLIP",
                                          MemoryOwner::references);
  if (!memory) return ok_status();  // another session took it meanwhile
  const auto kept = flip->keep(memory->bytes());
  if (!kept) return gone();
  if (*kept == 0) return ok_status();
  view.flip_memory = std::move(*memory);
  view.flip = std::move(*flip);
  return ok_status();
}

Status Comparison::find_references() {
  for (std::uint32_t v = 0; v < views_.size(); ++v) {
    ViewState& view = views_[v];
    const double started = now_s();
    pb::CompareResponse response;
    pb::CompareResponse::Reference& told = *response.mutable_reference();
    told.set_view(v);
    if (view.reference) {
      told.set_kept(true);
    } else {
      const std::string id = rendered_reference_id(*scene_, request_.views[v], request_.reference);
      view.reference = references_.find(id);
      told.set_kept(view.reference != nullptr);
      told.set_rendered_again(!view.reference && references_.was_let_go(id));
      if (!view.reference) {
        auto rendered = render_reference(resources_, references_.memory(), scene_, request_.views[v],
                                         request_.reference, *cancel_, [&](const ReferenceProgress& p) {
                                           tell_progress("reference", {nullptr, 0, 0, v}, p.samples, p.error);
                                         });
        if (!rendered) return rendered.error();
        view.reference = std::move(*rendered);
        references_.keep(view.reference);
        rendering_seconds_ += now_s() - started;
      }
    }
    const ReferencePicture& reference = *view.reference;
    told.set_noise(reference.half_a     ? pb::CompareResponse::Reference::NOISE_HALVES
                   : reference.variance ? pb::CompareResponse::Reference::NOISE_VARIANCE
                                        : pb::CompareResponse::Reference::NOISE_UNSPECIFIED);
    told.set_error(reference.error.value_or(0));
    told.set_samples(reference.samples);
    told.set_seconds(now_s() - started);
    told.set_reference_id(reference.id);
    if (const Status sent = tell(response); !sent.ok()) return sent;
    if (request_.sends({}, v)) {
      pb::CompareResponse::Picture name;
      name.set_reference(true);
      name.set_view(v);
      if (const Status sent = tell_picture(reference.mean, variance_of(reference), name); !sent.ok()) return sent;
    }
    if (const Status prepared = prepare_flip(view); !prepared.ok()) return prepared;
    if (request_.flicker && v > 0) {
      auto memory = resources_.memory.reserve_with_room(positions_bytes(request_), "the motion of a view",
                                                        MemoryOwner::pictures);
      if (!memory) return memory.error();
      view.positions = std::move(*memory);
      view.before =
          previous_positions(*scene_->snapshot, views_[v - 1].camera, view.camera, request_.width(), request_.height());
    }
  }
  return ok_status();
}

Budget Comparison::budget(std::uint32_t index, bool goes_on) const {
  Budget budget;
  if (request_.budgets_are_seconds) {
    budget.time_s = request_.budgets[index] - (goes_on ? request_.budgets[index - 1] : 0);
  } else {
    budget.samples = std::uint32_t(request_.budgets[index]);
  }
  return budget;
}

bool Comparison::is_done(const ComparedMode& mode, std::uint32_t seed_number, std::uint32_t budget) const {
  for (std::uint32_t view = 0; view < views_.size(); ++view) {
    if (!done_.count({mode.name, seed_number, budget, view})) return false;
  }
  return true;
}

bool Comparison::give_flip_back() {
  bool any = false;
  for (ViewState& view : views_) {
    any |= view.flip.has_value();
    view.flip.reset();
    view.flip_memory.release();
  }
  return any;
}

Result<std::unique_ptr<ComparedSession>> Comparison::open(const Turn& turn) {
  const bool pictures = turn.seed_number == 1 && sends_pictures(turn.mode->name);
  const auto create = [&] {
    return ComparedSession::create(resources_, scene_, *turn.mode, request_.seed(*turn.mode, turn.seed_number),
                                   pictures ? unsigned(kResolveVariance) : 0u, request_.gaze);
  };
  auto session = create();
  if (!session && session.error().code == ErrorCode::resource_exhausted && give_flip_back()) session = create();
  if (session && request_.exclusive) (*session)->hold_others(kMostHold);
  return session;
}

ComparedSession::Idle Comparison::idle(const Turn& turn) {
  return [this, turn](const FrameProgress& progress) {
    tell_progress(turn.mode->name, turn, progress.samples_per_pixel, 0);
  };
}

// One picture that grows from budget to budget. Those that came with the request are rendered again where later ones
// are missing: the picture cannot be had without them.
Status Comparison::play_still(const ComparedMode& mode, std::uint32_t seed_number) {
  const auto budgets = std::uint32_t(request_.budgets.size());
  std::uint32_t last = budgets;
  while (last > 0 && is_done(mode, seed_number, last - 1)) --last;
  const bool picture = seed_number == 1 && request_.sends(mode.name, 0);
  if (picture) last = budgets;
  if (last == 0) return ok_status();
  auto session = open({&mode, seed_number, 0, 0});
  if (!session) return session.error();
  PictureCost whole;
  double others = 0;
  for (std::uint32_t b = 0; b < last; ++b) {
    if (cancel_->cancelled() || gone_) return gone();
    const Turn turn{&mode, seed_number, b, 0};
    const auto cost = b == 0 ? (*session)->render(request_.views[0], budget(0, false), *cancel_, idle(turn))
                             : (*session)->go_on(budget(b, true), *cancel_, idle(turn));
    if (!cost) return cost.error();
    whole.seconds += cost->seconds;
    others += cost->others_share * cost->seconds;
    whole.samples = cost->samples;
    whole.progress = cost->progress;
    whole.others_share = whole.seconds > 0 ? others / whole.seconds : 0;
    rendering_seconds_ += cost->seconds;
    if (const Status told = tell_unit(turn, **session, whole, nullptr); !told.ok()) return told;
  }
  return ok_status();
}

Status Comparison::play_path(const ComparedMode& mode, std::uint32_t seed_number, std::uint32_t b) {
  const bool pictures = seed_number == 1 && b + 1 == request_.budgets.size() && sends_pictures(mode.name);
  if (is_done(mode, seed_number, b) && !pictures) return ok_status();
  auto session = open({&mode, seed_number, b, 0});
  if (!session) return session.error();
  Picture error_before;
  for (std::uint32_t v = 0; v < views_.size(); ++v) {
    if (cancel_->cancelled() || gone_) return gone();
    const Turn turn{&mode, seed_number, b, v};
    const bool preview = mode.picture == ComparedMode::Picture::preview && v > 0;
    const auto cost = preview ? (*session)->preview(request_.views[v], *cancel_, idle(turn))
                              : (*session)->render(request_.views[v], budget(b, false), *cancel_, idle(turn));
    if (!cost) return cost.error();
    rendering_seconds_ += cost->seconds;
    if (const Status told = tell_unit(turn, **session, *cost, &error_before); !told.ok()) return told;
  }
  return ok_status();
}

Result<std::vector<MeasuredValue>> Comparison::measure(const Turn& turn, const ComparedSession& session,
                                                       Picture* error_before) {
  const ViewState& view = views_[turn.view];
  const Picture& picture = session.picture();
  if (const Status finite = check_finite(picture); !finite.ok()) return finite.error();
  // HDR-FLIP takes longer than all others together: it has threads of its own, while nothing is rendered.
  PictureErrorOptions first = request_.errors, second = request_.errors;
  first.cancel = second.cancel = cancel_;
  first.measures &= ~kHdr;
  second.measures &= kHdr;
  second.threads = std::clamp(resources_.engine.threads(), 1, 64);
  ReferenceView reference = view.reference->view();
  if (view.flip) reference.flip = &*view.flip;
  auto beside = std::async(second.measures ? std::launch::async : std::launch::deferred,
                           [&] { return picture_errors(picture.view(), reference, second); });
  auto values = picture_errors(picture.view(), reference, first);
  auto more = second.measures ? beside.get() : Result<std::vector<MeasuredValue>>(std::vector<MeasuredValue>());
  if (cancel_->cancelled()) return gone();
  if (!values) return values.error();
  if (!more) return more.error();
  values->insert(values->end(), more->begin(), more->end());
  if (request_.flicker && error_before) {
    add_flicker(turn, picture, *error_before, &*values);
  }
  if (request_.told_rmse && session.told_rmse()) values->push_back({Measure::told_rmse, {}, *session.told_rmse()});
  return values;
}

void Comparison::add_flicker(const Turn& turn, const Picture& picture, Picture& error_before,
                             std::vector<MeasuredValue>* values) const {
  const ViewState& view = views_[turn.view];
  Picture error;
  subtract(picture, view.reference->mean, error);
  if (values && view.before && error_before.width > 0) {
    const PreviousPositions positions{picture.width, picture.height, view.before->x.data(), view.before->y.data()};
    const auto add = [&](const std::string& region, const std::vector<std::size_t>* pixels) {
      const auto change = flicker(error_before.view(), error.view(), positions, pixels);
      // Nothing of it was seen before: there is no flicker to tell.
      if (change) values->push_back({Measure::flicker, region, change->mean});
    };
    add({}, nullptr);
    for (const MeasuredRegion& region : request_.errors.regions) {
      const auto pixels = region.pixels(picture.width, picture.height);
      add(region.name, &pixels);
    }
  }
  error_before = std::move(error);
}

void Comparison::add_worst_pixels(const Turn& turn, const ComparedSession& session, pb::CompareUnit& unit) const {
  const Picture &picture = session.picture(), &reference = views_[turn.view].reference->mean;
  for (const WorstPixel& worst : worst_pixels(picture.view(), reference.view(), request_.worst_pixels)) {
    pb::ComparePixel& out = *unit.add_worst();
    out.set_x(worst.x);
    out.set_y(worst.y);
    out.set_share(worst.share);
    const std::size_t i = std::size_t(worst.y) * std::size_t(picture.width) + std::size_t(worst.x);
    const auto set = [i](const Picture& from, pb::Vec3& to) {
      to.set_x(from.channels[0][i]);
      to.set_y(from.channels[1][i]);
      to.set_z(from.channels[2][i]);
    };
    set(picture, *out.mutable_picture());
    set(reference, *out.mutable_reference());
    if (turn.seed_number > 1 || turn.mode->picture != ComparedMode::Picture::film || session.samples().empty())
      continue;
    const auto brightest =
        brightest_sample(*scene_->snapshot, session.begin(), worst.x, worst.y, session.samples()[i], *cancel_);
    if (brightest) out.set_replay_token(make_replay_token(*scene_, session.begin(), *brightest));
  }
}

Status Comparison::tell_unit(const Turn& turn, const ComparedSession& session, const PictureCost& cost,
                             Picture* error_before) {
  const Key key{turn.mode->name, turn.seed_number, turn.budget, turn.view};
  const bool last = turn.budget + 1 == request_.budgets.size();
  if (turn.seed_number == 1 && last && request_.sends(turn.mode->name, turn.view)) {
    pb::CompareResponse::Picture name;
    name.set_mode(turn.mode->name);
    name.set_seed_number(turn.seed_number);
    name.set_budget(turn.budget);
    name.set_view(turn.view);
    const bool film = turn.mode->picture == ComparedMode::Picture::film;
    if (const Status sent = tell_picture(session.picture(), film ? session.variance() : Picture(), name); !sent.ok())
      return sent;
  }
  if (done_.contains(key)) {
    if (request_.flicker && error_before) add_flicker(turn, session.picture(), *error_before, nullptr);
    return ok_status();
  }
  auto values = measure(turn, session, error_before);
  if (!values) return values.error();
  pb::CompareResponse response;
  pb::CompareUnit& unit = *response.mutable_unit();
  unit.set_mode(turn.mode->name);
  unit.set_seed_number(turn.seed_number);
  unit.set_budget(turn.budget);
  unit.set_view(turn.view);
  unit.set_seed(request_.seed(*turn.mode, turn.seed_number));
  unit.set_seconds(cost.seconds);
  unit.set_samples(cost.samples);
  unit.set_rays(cost.progress.trace.rays);
  unit.set_paths(cost.progress.trace.paths);
  unit.set_invalid_samples(cost.progress.trace.invalid_samples);
  unit.set_reuse_share(cost.progress.reuse_share);
  unit.set_others_share(cost.others_share);
  unit.set_disturbed(cost.others_share > kDisturbed);
  unit.set_call(call_);
  for (const MeasuredValue& value : *values) {
    pb::CompareValue& out = *unit.add_values();
    out.set_measure(to_message(value.measure));
    out.set_region(value.region);
    out.set_value(value.value);
    out.set_reference_error(value.reference_error);
  }
  if (last && request_.worst_pixels > 0) add_worst_pixels(turn, session, unit);
  units_.push_back(unit);
  done_.insert(key);
  return tell(response);
}

Status Comparison::tell_picture(const Picture& picture, const Picture& variance, pb::CompareResponse::Picture name) {
  const std::uint64_t row_bytes = picture_bytes(picture.width, 1, 2);
  const int rows = int(std::clamp<std::uint64_t>(kTileBytes / row_bytes, 1, kRowsPerTile));
  for (int y0 = 0; y0 < picture.height; y0 += rows) {
    const PixelRect window{0, y0, picture.width, std::min(y0 + rows, picture.height)};
    const std::size_t start = std::size_t(y0) * std::size_t(picture.width);
    std::vector<TileChannel> channels;
    for (int c = 0; c < 3; ++c) {
      const char name_of[] = {"RGB"[c], 0};
      channels.push_back({name_of, picture.channels[c].data() + start, true});
      if (variance.width > 0)
        channels.push_back({std::string("variance.") + name_of, variance.channels[c].data() + start, true});
    }
    const auto exr =
        encode_tile({window, picture.width, picture.height}, channels, {TilePixelType::float32, TileCompression::none});
    if (!exr) return exr.error();
    pb::CompareResponse response;
    pb::CompareResponse::Picture& out = *response.mutable_picture();
    out = name;
    pb::Tile& tile = *out.mutable_tile();
    write_rect(window, *tile.mutable_window());
    tile.set_exr(exr->data(), exr->size());
    tile.set_crc32(crc32_of(exr->data(), exr->size()));
    tile.set_final(true);
    out.set_last(window.y1 == picture.height);
    if (const Status sent = tell(response); !sent.ok()) return sent;
  }
  return ok_status();
}

}  // namespace helio
