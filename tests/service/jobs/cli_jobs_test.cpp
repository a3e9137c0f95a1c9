// heliograph submit, jobs, job, top and merge against a daemon with a state folder.
#include <signal.h>

#include <algorithm>
#include <filesystem>

#include "cli_test.h"
#include "daemon_process.h"
#include "renderer/codec/tile_codec.h"

namespace helio::test {
namespace {

constexpr std::uint64_t kMaxPixels = 1 << 20;

class CliJobs : public CliTest {
 protected:
  std::vector<std::string> daemon_words(std::vector<std::string> more = {}) const {
    std::vector<std::string> words = {"--render-threads", "1", "--state", folder_ / "state"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  std::vector<std::string> at(const DaemonProcess& daemon, std::vector<std::string> words) const {
    words.insert(words.end(), {"--server", daemon.address()});
    return words;
  }
  // Submits the square, black around it, and returns the id.
  std::string submit(const DaemonProcess& daemon, std::vector<std::string> more = {}) {
    std::vector<std::string> words = {"submit", "quad.gltf", "--environment", "0,0,0", "--size", "40x48"};
    words.insert(words.end(), more.begin(), more.end());
    const auto json = heliograph_json(at(daemon, words));
    return json.value("job_id", "");
  }
  const std::string endless_ = "1000000000";
};

TEST_F(CliJobs, AJobIsSubmittedWatchedAndFetched) {
  const DaemonProcess daemon(daemon_words());
  const std::string id = submit(daemon, {"--samples", "8", "--name", "one", "--priority", "-3"});
  ASSERT_EQ(id.substr(0, 2), "j-");
  // The beginning of an id will do.
  const ProcessResult watched = heliograph(at(daemon, {"job", id.substr(0, 8), "--watch", "--fetch", "one.exr"}));
  EXPECT_EQ(watched.exit_code, 0) << watched.err;
  EXPECT_NE(watched.out.find("one.exr"), std::string::npos) << watched.out;
  const auto picture = read_exr(folder_ / "one.exr", kMaxPixels);
  ASSERT_TRUE(picture) << picture.error().to_string();
  EXPECT_EQ((*picture->find("R"))[24 * 40 + 20], 2);
  EXPECT_EQ((*picture->find("R"))[0], 0);
  EXPECT_EQ((*picture->find("samples"))[0], 8);

  const auto json = heliograph_json(at(daemon, {"job", id}));
  EXPECT_EQ(json["state"], "succeeded");
  EXPECT_EQ(json["name"], "one");
  EXPECT_EQ(json["priority"], -3);
  EXPECT_EQ(json["done"], 1);
  EXPECT_EQ(json["results"].size(), 1u);
  EXPECT_EQ(json["results"][0]["ended_by"], "samples");
  EXPECT_EQ(json["results"][0]["bytes"], std::filesystem::file_size(folder_ / "one.exr"));

  const auto all = heliograph_json(at(daemon, {"jobs"}));
  EXPECT_EQ(all["total"], 1);
  EXPECT_EQ(all["jobs"][0]["job_id"], id);
  EXPECT_EQ(heliograph_json(at(daemon, {"jobs", "--state", "running,queued"}))["total"], 0);
  const ProcessResult table = heliograph(at(daemon, {"jobs"}));
  EXPECT_NE(table.out.find(id.substr(0, 10) + "  one   succeeded  100 %"), std::string::npos) << table.out;
  // On a pipe top prints one table and ends.
  const ProcessResult top = heliograph(at(daemon, {"top"}));
  EXPECT_EQ(top.exit_code, 0) << top.err;
  EXPECT_NE(top.out.find("[##########] 100 %"), std::string::npos) << top.out;
  EXPECT_EQ(top.out.find('\033'), std::string::npos);
}

TEST_F(CliJobs, TheSameTokenIsTheSameJob) {
  const DaemonProcess daemon(daemon_words());
  const std::string first = submit(daemon, {"--samples", "2", "--client-token", "once"});
  EXPECT_EQ(submit(daemon, {"--samples", "2", "--client-token", "once"}), first);
  const auto other =
      heliograph(at(daemon, {"submit", "quad.gltf", "--size", "8x8", "--samples", "2", "--client-token", "once"}));
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_NE(other.err.find("client_token"), std::string::npos) << other.err;
}

TEST_F(CliJobs, PauseResumePriorityAndCancel) {
  const DaemonProcess daemon(daemon_words({"--max-jobs", "1"}));
  const std::string id = submit(daemon, {"--samples", endless_}), next = submit(daemon, {"--samples", endless_});
  EXPECT_EQ(heliograph_json(at(daemon, {"job", next, "--priority", "7"}))["priority"], 7);
  heliograph_json(at(daemon, {"job", next, "--pause"}));
  EXPECT_EQ(heliograph_json(at(daemon, {"job", next}))["state"], "paused");
  EXPECT_EQ(heliograph_json(at(daemon, {"job", next, "--resume"}))["state"], "queued");
  const ProcessResult early = heliograph(at(daemon, {"job", id, "--fetch", "x.exr"}));
  EXPECT_EQ(early.exit_code, 1);
  EXPECT_NE(early.err.find("--fetch: nothing to fetch: the job is "), std::string::npos) << early.err;
  EXPECT_FALSE(exists("x.exr"));
  const ProcessResult other_format = heliograph(at(daemon, {"job", id, "--fetch", "x.png"}));
  EXPECT_EQ(other_format.exit_code, 2);
  EXPECT_NE(other_format.err.find("--fetch: 'x.png' is written as OpenEXR"), std::string::npos) << other_format.err;
  auto words = at(daemon, {"job", id});
  words.push_back("--fetch");
  const ProcessResult no_value = heliograph(words);
  EXPECT_EQ(no_value.exit_code, 2);
  EXPECT_NE(no_value.err.find("(see heliograph job --help)"), std::string::npos) << no_value.err;
  heliograph_json(at(daemon, {"job", next, "--pause"}));
  const ProcessResult twice = heliograph(at(daemon, {"job", next, "--pause"}));
  EXPECT_EQ(twice.exit_code, 1);
  EXPECT_NE(twice.err.find("is PAUSED already"), std::string::npos) << twice.err;
  const ProcessResult waiting = heliograph(at(daemon, {"job", next, "--fetch", "x.exr"}));
  EXPECT_NE(waiting.err.find("--resume lets it go on"), std::string::npos) << waiting.err;

  heliograph_json(at(daemon, {"job", next, "--cancel"}));
  const auto canceled = heliograph_json(at(daemon, {"job", next, "--watch"}), 1);
  EXPECT_EQ(canceled["state"], "canceled");
  EXPECT_EQ(canceled["exit_code"], 1);
  const ProcessResult again = heliograph(at(daemon, {"job", next, "--cancel"}));
  EXPECT_EQ(again.exit_code, 1);
  expect_one_line(again.err);
}

TEST_F(CliJobs, CtrlCEndsTheWatchAndNotTheJob) {
  const DaemonProcess daemon(daemon_words());
  const std::string id = submit(daemon, {"--samples", endless_});
  Process watch(HELIOGRAPH_PROGRAM, at(daemon, {"job", id, "--watch", "--progress", "always"}), folder_.path());
  ASSERT_TRUE(watch.wait_for_errors("samples/s")) << watch.errors();
  watch.send_signal(SIGINT);
  const ProcessResult result = watch.wait(20);
  EXPECT_EQ(result.exit_code, 130);
  EXPECT_NE(result.err.find("interrupted; job " + id + " goes on"), std::string::npos) << result.err;
  EXPECT_EQ(heliograph_json(at(daemon, {"job", id}))["state"], "running");
}

TEST_F(CliJobs, TopShowsJobsAsTheyChangeAndLeavesTheTerminalAsItWas) {
  if (!has_pseudo_terminals()) GTEST_SKIP() << "no pseudo-terminals here";
  const DaemonProcess daemon(daemon_words());
  Process top(HELIOGRAPH_PROGRAM, at(daemon, {"top", "--interval", "0.1"}), folder_.path(),
              Process::Stderr::all_terminal);
  ASSERT_TRUE(top.wait_for_errors("0 running, 0 queued, 0 paused")) << top.errors();
  // A job that comes, goes on and ends while nobody asks.
  const std::string id = submit(daemon, {"--samples", endless_, "--name", "here"});
  ASSERT_TRUE(top.wait_for_errors("1 running")) << top.errors();
  ASSERT_TRUE(top.wait_for_errors(id.substr(0, 10) + "  here  running  [----------] 0 %")) << top.errors();
  heliograph_json(at(daemon, {"job", id, "--cancel"}));
  ASSERT_TRUE(top.wait_for_errors("here  canceled")) << top.errors();
  top.type("q");
  const ProcessResult result = top.wait(20);
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err.rfind("\033[?25h\033[?1049l"), result.err.size() - 14);  // cursor and screen are back
}

// A daemon that is killed and started again at the same address: the watch goes on, and misses nothing.
TEST_F(CliJobs, TheWatchOutlivesTheDaemon) {
  std::string id, address;
  std::unique_ptr<Process> watch;
  {
    DaemonProcess daemon(daemon_words({}));
    address = daemon.address();
    id = submit(daemon, {"--samples", "6000"});
    watch = std::make_unique<Process>(HELIOGRAPH_PROGRAM,
                                      std::vector<std::string>{"job", id, "--watch", "--fetch", "x.exr", "--wait", "60",
                                                               "--server", address, "--progress", "always"},
                                      folder_.path());
    ASSERT_TRUE(watch->wait_for_errors("samples/s")) << watch->errors();
    daemon.signal(SIGKILL);
    daemon.wait();
    ASSERT_TRUE(watch->wait_for_errors("waiting for it")) << watch->errors();
  }
  const DaemonProcess daemon(daemon_words({"--listen", address}));
  const ProcessResult result = watch->wait(120);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("running -> queued"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("running -> succeeded"), std::string::npos) << result.out;
  EXPECT_TRUE(exists("x.exr"));
}

TEST_F(CliJobs, ACameraPathIsFetchedViewByView) {
  const DaemonProcess daemon(daemon_words());
  write_file(folder_ / "path.json", R"({"views": [{}, {"turn_degrees": 90}]})");
  const std::string id = submit(daemon, {"--samples", "2", "--path", "path.json"});
  heliograph_json(at(daemon, {"job", id, "--watch", "--fetch", "v.#.exr"}));
  const auto first = read_exr(folder_ / "v.0.exr", kMaxPixels), second = read_exr(folder_ / "v.1.exr", kMaxPixels);
  ASSERT_TRUE(first && second);
  EXPECT_EQ((*first->find("R"))[24 * 40 + 20], 2);
  EXPECT_EQ((*second->find("R"))[24 * 40 + 20], 0);  // looks past the square
  heliograph_json(at(daemon, {"job", id, "--fetch", "one.exr", "--view", "1"}));
  EXPECT_EQ(read_file(folder_ / "one.exr"), read_file(folder_ / "v.1.exr"));
  const ProcessResult none = heliograph(at(daemon, {"job", id, "--fetch", "one.exr", "--view", "2"}));
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_NE(none.err.find("--view: 2; the job has views [0, 1]"), std::string::npos) << none.err;

  write_file(folder_ / "own.json", R"({"views": [{}, {"samples": 3}]})");
  const ProcessResult own = heliograph(at(daemon, {"submit", "quad.gltf", "--path", "own.json"}));
  EXPECT_EQ(own.exit_code, 2);
  EXPECT_NE(own.err.find("--path: view 1 has a budget of its own"), std::string::npos) << own.err;
}

TEST_F(CliJobs, ThePictureMayBeWrittenOnTheDaemonsMachine) {
  std::filesystem::create_directory(folder_ / "out");
  const DaemonProcess daemon(daemon_words({"--output-root", folder_ / "out"}));
  const std::string id = submit(daemon, {"--samples", "2", "--output-on-server", "q.exr"});
  const auto json = heliograph_json(at(daemon, {"job", id, "--watch"}));
  EXPECT_EQ(std::filesystem::path(json["results"][0]["file"].get<std::string>()).filename(), "q.exr");
  EXPECT_TRUE(exists("out/q.exr"));
  const ProcessResult again =
      heliograph(at(daemon, {"submit", "quad.gltf", "--size", "8x8", "--samples", "1", "--output-on-server", "q.exr"}));
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_NE(again.err.find("overwrite"), std::string::npos) << again.err;
}

TEST_F(CliJobs, ADaemonThatKeepsNoJobsSaysSo) {
  const DaemonProcess daemon({"--render-threads", "1", "--state", "none"});
  const ProcessResult submitted = heliograph(at(daemon, {"submit", "quad.gltf", "--size", "8x8", "--samples", "1"}));
  EXPECT_EQ(submitted.exit_code, 1);
  EXPECT_NE(submitted.err.find("keeps no jobs: it was started without a state folder"), std::string::npos)
      << submitted.err;
  expect_one_line(submitted.err);
  for (const char* command : {"jobs", "top"}) {
    const ProcessResult listed = heliograph(at(daemon, {command}));
    EXPECT_EQ(listed.exit_code, 1) << command;
    expect_one_line(listed.err);
    EXPECT_NE(listed.err.find("state folder"), std::string::npos) << listed.err;
  }
}

TEST_F(CliJobs, IdsThatAreNoneOrSeveralAreNamed) {
  const DaemonProcess daemon(daemon_words());
  const std::string a = submit(daemon, {"--samples", "1"}), b = submit(daemon, {"--samples", "1"});
  const ProcessResult several = heliograph(at(daemon, {"job", "j-"}));
  EXPECT_EQ(several.exit_code, 2);
  EXPECT_NE(several.err.find("the ids of 2 jobs begin with 'j-'"), std::string::npos) << several.err;
  EXPECT_NE(several.err.find(a), std::string::npos) << several.err;
  const ProcessResult none = heliograph(at(daemon, {"job", "j-zz"}));
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_NE(none.err.find("no job's id is or begins with 'j-zz'"), std::string::npos) << none.err;
}

using CliMerge = CliTest;

// Bit for bit, and as files byte for byte: by the command itself.
TEST_F(CliMerge, PartsOfARenderAreTheWhole) {
  const std::vector<std::string> common = {
      "render",    std::string(HELIO_SOURCE_DIR) + "/scenes/cornell-box/cornell-box.gltf",
      "--size",    "40x97",
      "--samples", "4",
      "--filter",  "gaussian",
      "--layers",  "alpha,depth,normal,albedo,density"};
  const auto with = [&](std::vector<std::string> more) {
    std::vector<std::string> words = common;
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  heliograph_json(with({"--output", "whole.exr"}));
  for (const char* number : {"1", "2", "3"})
    heliograph_json(with({"--shard", std::string(number) + "/3", "--output", std::string("p") + number + ".exr"}));
  const auto json = heliograph_json({"merge", "p3.exr", "p1.exr", "p2.exr", "-o", "merged.exr"});
  EXPECT_EQ(json["parts"][0]["file"], "p1.exr");
  EXPECT_EQ(json["parts"][2]["end_row"], 97);
  EXPECT_EQ(json["mixed_builds"], false);
  EXPECT_EQ(read_file(folder_ / "merged.exr"), read_file(folder_ / "whole.exr"));

  const ProcessResult gap = heliograph({"merge", "p3.exr", "p1.exr", "-o", "gap.exr"});
  EXPECT_EQ(gap.exit_code, 1);
  EXPECT_NE(gap.err.find("part 2/3: is missing: rows [32, 64)"), std::string::npos) << gap.err;
  EXPECT_FALSE(exists("gap.exr"));
  heliograph_json(with({"--shard", "2/3", "--seed", "9", "--output", "other.exr"}));
  const ProcessResult seed = heliograph({"merge", "p1.exr", "other.exr", "p3.exr", "-o", "gap.exr"});
  EXPECT_EQ(seed.exit_code, 1);
  EXPECT_NE(seed.err.find("other.exr: differs from p1.exr"), std::string::npos) << seed.err;
  EXPECT_NE(seed.err.find("settings.seed"), std::string::npos) << seed.err;
}

TEST_F(CliMerge, RefusesWhatCannotBeRenderedInParts) {
  const auto refused = [&](std::vector<std::string> more, const std::string& reason) {
    std::vector<std::string> words = {"render", "quad.gltf", "--size", "40x48", "--shard", "1/2"};
    words.insert(words.end(), more.begin(), more.end());
    const ProcessResult result = heliograph(words);
    EXPECT_EQ(result.exit_code, 2) << result.out;
    expect_one_line(result.err);
    EXPECT_NE(result.err.find("--shard: " + reason), std::string::npos) << result.err;
  };
  refused({"--mode", "adaptive"}, "goes with --mode pt alone");
  refused({"--integrator", "bdpt"}, "goes with --integrator path alone");
  refused({"--time", "1"}, "goes with --samples alone");
  refused({"--error", "1"}, "goes with --samples alone");
  refused({"--region", "0,0,8,8"}, "is given beside --region");
  refused({"--png", "x.png"}, "does not go with the layer display");
  refused({"--layers", "display"}, "does not go with the layer display");
  for (const char* shard : {"0/2", "3/2", "1", "a/b", "4/4"}) {
    const ProcessResult result = heliograph({"render", "quad.gltf", "--size", "40x48", "--shard", shard});
    EXPECT_EQ(result.exit_code, 2) << shard;
    EXPECT_NE(result.err.find("--shard: '" + std::string(shard) + "'"), std::string::npos) << result.err;
  }
  const ProcessResult none = heliograph({"merge", "-o", "x.exr", "--mixed"});
  EXPECT_EQ(none.exit_code, 2);
  for (const char* part : {"PART.exr: is missing", "--mixed: is not an option of merge; did you mean --mix?"})
    EXPECT_NE(none.err.find(part), std::string::npos) << none.err;
}

TEST_F(CliJobs, SubmitFollowsAJobToItsEnd) {
  DaemonProcess daemon(daemon_words());
  const ProcessResult followed = heliograph(
      at(daemon, {"submit", "quad.gltf", "--size", "40x48", "--samples", "8", "--watch"}));
  EXPECT_EQ(followed.exit_code, 0) << followed.err;
  EXPECT_NE(followed.out.find("succeeded"), std::string::npos) << followed.out;
  EXPECT_EQ(followed.out.find("to follow it"), std::string::npos) << followed.out;
  const auto json = heliograph_json(
      at(daemon, {"submit", "quad.gltf", "--size", "40x48", "--samples", "8", "--watch"}));
  EXPECT_EQ(json["state"], "succeeded");
  EXPECT_EQ(json["results"].size(), 1u);

  Process endless(HELIOGRAPH_PROGRAM,
                  at(daemon, {"submit", "quad.gltf", "--size", "40x48", "--samples", endless_, "--watch"}),
                  folder_.path());
  ASSERT_TRUE(endless.wait_for_output("running")) << endless.errors();
  endless.send_signal(SIGINT);
  const ProcessResult interrupted = endless.wait(60);
  EXPECT_EQ(interrupted.exit_code, 130) << interrupted.err;
  EXPECT_NE(interrupted.err.find("goes on: heliograph job j-"), std::string::npos) << interrupted.err;
  const auto running = heliograph_json(at(daemon, {"jobs", "--state", "running"}));
  ASSERT_EQ(running["total"], 1);

  Process canceled(HELIOGRAPH_PROGRAM,
                   at(daemon, {"submit", "quad.gltf", "--size", "40x48", "--samples", endless_, "--watch"}),
                   folder_.path());
  ASSERT_TRUE(canceled.wait_for_output("running")) << canceled.errors();
  const auto both = heliograph_json(at(daemon, {"jobs", "--state", "running"}));
  ASSERT_EQ(both["jobs"].size(), 2u);
  for (const auto& job : both["jobs"]) heliograph_json(at(daemon, {"job", job["job_id"], "--cancel"}));
  const ProcessResult ended = canceled.wait(60);
  EXPECT_EQ(ended.exit_code, 1) << ended.err;
  EXPECT_NE(ended.err.find("the job was canceled"), std::string::npos) << ended.err;
}

// As of heliograph move: the same views.
TEST_F(CliJobs, PathsByNameHaveAScaleAndAPivot) {
  const DaemonProcess daemon(daemon_words());
  const std::vector<std::string> path = {"--path", "orbit", "--steps", "3", "--step", "10", "--pivot", "0,0,1"};
  std::vector<std::string> words = {"--samples", "2", "--watch"};
  words.insert(words.end(), path.begin(), path.end());
  const std::string id = submit(daemon, words);
  EXPECT_EQ(heliograph_json(at(daemon, {"job", id, "--fetch", "j.#.exr"}))["views"], 4);
  std::vector<std::string> moved = {"move", "quad.gltf", "--environment", "0,0,0",  "--size", "40x48", "--mode",
                                    "pt",   "--samples", "2",             "--output", "m.#.exr"};
  moved.insert(moved.end(), path.begin(), path.end());
  EXPECT_EQ(heliograph_json(moved)["frames"].size(), 4u);
  for (int view = 0; view < 4; ++view) {
    const std::string number = std::to_string(view) + ".exr";
    const auto job = read_exr(folder_ / ("j." + number), kMaxPixels);
    const auto move = read_exr(folder_ / ("m." + number), kMaxPixels);
    ASSERT_TRUE(job && move);
    EXPECT_EQ(*job->find("R"), *move->find("R")) << view;
  }
  const auto refused = [&](std::vector<std::string> more, const std::string& problem) {
    std::vector<std::string> words = {"submit", "quad.gltf", "--samples", "2"};
    words.insert(words.end(), more.begin(), more.end());
    const ProcessResult result = heliograph(at(daemon, words));
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find(problem), std::string::npos) << result.err;
  };
  refused({"--steps", "3"}, "--steps: is only valid with a --path by name");
  refused({"--step", "3"}, "--step: is only valid with a --path by name");
  refused({"--pivot", "0,0,0"}, "--pivot: is only valid with --path");
  refused({"--path", "zoom", "--step", "0"}, "--path");
}

// Two daemons' jobs: parts and whole.
TEST_F(CliJobs, PartsOfAJobAreTheWhole) {
  const DaemonProcess one(daemon_words());
  const DaemonProcess two({"--render-threads", "2", "--state", folder_ / "state2"});
  const auto fetch = [&](const DaemonProcess& daemon, std::vector<std::string> more, const std::string& file) {
    const std::string id = submit(daemon, more);
    heliograph_json(at(daemon, {"job", id, "--watch", "--fetch", file}));
  };
  fetch(one, {"--samples", "4"}, "whole.exr");
  fetch(one, {"--samples", "4", "--shard", "1/2"}, "p1.exr");
  fetch(two, {"--samples", "4", "--shard", "2/2"}, "p2.exr");
  heliograph_json({"merge", "p1.exr", "p2.exr", "-o", "merged.exr"});
  const auto whole = read_exr(folder_ / "whole.exr", kMaxPixels), merged = read_exr(folder_ / "merged.exr", kMaxPixels);
  ASSERT_TRUE(whole && merged);
  EXPECT_EQ(whole->names, merged->names);
  EXPECT_EQ(whole->channels, merged->channels);
  EXPECT_EQ(whole->header.origin, merged->header.origin);
}

}  // namespace
}  // namespace helio::test
