#include "server/compare/compare_table.h"

namespace helio {
namespace {

pb::CompareInterval to_message(const Interval& interval) {
  pb::CompareInterval message;
  message.set_mean(interval.mean);
  message.set_low(interval.low);
  message.set_high(interval.high);
  message.set_known(interval.known);
  return message;
}

pb::CompareRatio::Kind to_message(RatioKind kind) {
  switch (kind) {
    case RatioKind::equal_error:
      return pb::CompareRatio::KIND_EQUAL_ERROR;
    case RatioKind::equal_time:
      return pb::CompareRatio::KIND_EQUAL_TIME;
    case RatioKind::equal_samples:
      return pb::CompareRatio::KIND_EQUAL_SAMPLES;
    case RatioKind::speed:
      return pb::CompareRatio::KIND_SPEED;
  }
  return pb::CompareRatio::KIND_UNSPECIFIED;
}

pb::CompareVerdict to_message(Verdict verdict) {
  switch (verdict) {
    case Verdict::better:
      return pb::COMPARE_VERDICT_BETTER;
    case Verdict::worse:
      return pb::COMPARE_VERDICT_WORSE;
    case Verdict::undecided:
      return pb::COMPARE_VERDICT_UNDECIDED;
  }
  return pb::COMPARE_VERDICT_UNSPECIFIED;
}

}  // namespace

// The protocol has 0 for none.
pb::CompareMeasure to_message(Measure measure) {
  static_assert(kMeasures == int(pb::COMPARE_MEASURE_TOLD_RMSE));
  return static_cast<pb::CompareMeasure>(int(measure) + 1);
}

ComparisonScript script_of(const ComparisonRequest& request) {
  ComparisonScript script;
  for (const ComparedMode& mode : request.modes) script.modes.push_back(mode.name);
  for (const ComparedMode& mode : request.modes) {
    if (mode.picture == ComparedMode::Picture::preview) script.preview_modes.push_back(mode.name);
  }
  script.budgets = request.budgets;
  script.budgets_are_seconds = request.budgets_are_seconds;
  script.views = std::uint32_t(request.views.size());
  script.common_seeds = request.common_seeds;
  return script;
}

ComparedUnit unit_of(const pb::CompareUnit& message) {
  ComparedUnit unit;
  unit.mode = message.mode();
  unit.seed_number = message.seed_number();
  unit.budget = message.budget();
  unit.view = message.view();
  unit.seconds = message.seconds();
  unit.samples = message.samples();
  unit.disturbed = message.disturbed();
  unit.call = message.call();
  for (const pb::CompareValue& value : message.values())
    unit.values.push_back({Measure(int(value.measure()) - 1), value.region(), value.value(), value.reference_error()});
  return unit;
}

pb::CompareTable to_message(const ComparisonTable& table) {
  pb::CompareTable message;
  for (const ComparedPoint& point : table.points) {
    pb::ComparePoint& out = *message.add_points();
    out.set_mode(point.mode);
    out.set_budget(point.budget);
    out.set_view(point.view.value_or(0));
    out.set_all_views(!point.view);
    out.set_seeds(point.seeds);
    *out.mutable_seconds() = to_message(point.seconds);
    out.set_samples(point.samples);
    for (const ComparedPoint::Value& value : point.values) {
      pb::ComparePoint::Value& v = *out.add_values();
      v.set_measure(to_message(value.measure));
      v.set_region(value.region);
      *v.mutable_value() = to_message(value.value);
      v.set_few_pixels_decide(value.few_pixels_decide);
    }
    out.set_disturbed(point.disturbed);
  }
  for (const ComparedRatio& ratio : table.ratios) {
    pb::CompareRatio& out = *message.add_ratios();
    out.set_kind(to_message(ratio.kind));
    out.set_mode(ratio.mode);
    out.set_baseline(ratio.baseline);
    if (ratio.kind != RatioKind::speed) out.set_measure(to_message(ratio.measure));
    out.set_region(ratio.region);
    out.set_at(ratio.at);
    *out.mutable_ratio() = to_message(ratio.ratio);
    out.set_verdict(to_message(ratio.verdict));
    out.set_few_pixels_decide(ratio.few_pixels_decide);
    out.set_different_calls(ratio.different_calls);
  }
  for (const std::string& sentence : table.sentences) message.add_sentences(sentence);
  return message;
}

}  // namespace helio
