// The subcommands: each adds its figures, or says on stderr which it must leave out. An Error means that the bench
// itself failed; figures added before stay.
#pragma once

#include "renderer/base/result.h"
#include "tests/bench/bench_context.h"
#include "tests/bench/reports/comparison_record.h"
#include "tests/bench/reports/figures.h"

namespace helio::bench {

Status run_speed(BenchContext& context, Figures& figures);
Status run_rays(BenchContext& context, Figures& figures);
Status run_load(BenchContext& context, Figures& figures);
Status run_lamps(BenchContext& context, Figures& figures);
Status run_latency(BenchContext& context, Figures& figures);
Status run_drag(BenchContext& context, Figures& figures);
Status run_tev(BenchContext& context, Figures& figures);
Status run_python(BenchContext& context, Figures& figures);
Status run_viewer(BenchContext& context, Figures& figures);
Status run_display(BenchContext& context, Figures& figures);
Status run_denoisers(BenchContext& context, Figures& figures);
Status run_previews(BenchContext& context, Figures& figures);
Status run_foveated(BenchContext& context, Figures& figures);
Status run_cancel(BenchContext& context, Figures& figures);
Status run_stream(BenchContext& context, Figures& figures);
Status run_service(BenchContext& context, Figures& figures);
Status run_sessions(BenchContext& context, Figures& figures);
Status run_features(BenchContext& context, Figures& figures);
Status run_metrics(BenchContext& context, Figures& figures);
Status run_adaptive(BenchContext& context, Figures& figures);
Status run_bidir(BenchContext& context, Figures& figures);
Status run_reuse(BenchContext& context, Figures& figures);
Status run_vulkan(BenchContext& context, Figures& figures);
// `peers --real`. invalid_argument: a scene that is none of its own.
Status run_real(BenchContext& context, Figures& figures);

// Comparisons instead of figures.
Result<std::vector<pb::CompareRecord>> run_peers(BenchContext& context);
// One for each scene, step (options.step_degrees) and number of samples a step (options.step_samples).
// invalid_argument: a step that camera_paths.h has not.
Result<std::vector<pb::CompareRecord>> run_turns(BenchContext& context);

}  // namespace helio::bench
