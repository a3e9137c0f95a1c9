// How much a token may have at a time.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <map>
#include <set>

#include "security/token_fixture.h"
#include "server/base/memory_account.h"

namespace helio::test {
namespace {

using grpc::StatusCode;
using Stub = pb::RenderService::Stub;

constexpr std::uint32_t kNoEnd = 1u << 30;  // samples

class Quotas : public TokenTest {
 protected:
  void start_for(const TokenQuotas& of_alice, const std::function<void(ServerConfig&)>& change = {}) {
    add_token("alice", Role::render, of_alice);
    add_token("bob", Role::render);
    start_with_tokens(change);
    scene_ = load_as("bob");
  }
  pb::RunJobRequest job() const {
    pb::RunJobRequest request;
    request.set_scene_id(scene_);
    request.mutable_settings()->set_width(16);
    request.mutable_settings()->set_height(16);
    request.mutable_budget()->set_samples(kNoEnd);
    return request;
  }
  grpc::Status submit_as(const std::string& name, std::string* id = nullptr) {
    pb::SubmitJobRequest request;
    *request.mutable_job() = job();
    pb::SubmitJobResponse response;
    const grpc::Status status = call_as(name, &Stub::SubmitJob, request, &response);
    if (id) *id = response.job().job_id();
    return status;
  }
  grpc::Status cancel_as(const std::string& name, const std::string& id) {
    pb::CancelJobRequest request;
    request.set_job_id(id);
    pb::CancelJobResponse response;
    return call_as(name, &Stub::CancelJob, request, &response);
  }

  std::string scene_;
};

TEST_F(Quotas, OfSessionsCountThoseWithAListener) {
  start_for({.sessions = 2, .jobs = {}, .memory = {}});
  std::string ids[3];
  ASSERT_TRUE(create_as("alice", scene_, 16, &ids[0]).ok());
  TokenStream first(stub(), token("alice"), ids[0]);
  ASSERT_TRUE(first.opened());
  ASSERT_TRUE(create_as("alice", scene_, 16, &ids[1]).ok());
  // The second has no listener: it makes room for a third, as a full daemon would.
  ASSERT_TRUE(create_as("alice", scene_, 16, &ids[2]).ok());
  pb::CloseSessionRequest close;
  close.set_session_id(ids[1]);
  pb::CloseSessionResponse closed;
  EXPECT_EQ(call_as("alice", &Stub::CloseSession, close, &closed).error_code(), StatusCode::NOT_FOUND);
  TokenStream third(stub(), token("alice"), ids[2]);
  ASSERT_TRUE(third.opened());
  const grpc::Status refused = create_as("alice", scene_, 16);
  expect_status(refused, StatusCode::RESOURCE_EXHAUSTED,
                {"quota sessions", "'alice'", "2 are open", "allowed: 2", "try again"});
  EXPECT_TRUE(create_as("bob", scene_, 16).ok()) << "others' are not counted";
}

TEST_F(Quotas, OfJobsCountKeptOnesRunJobsAndComparisons) {
  start_for({.sessions = {}, .jobs = 2, .memory = {}}, [&](ServerConfig& config) { config.state = in("state"); });
  std::string kept;
  ASSERT_TRUE(submit_as("alice", &kept).ok());
  {
    grpc::ClientContext context;
    name_token(context, "alice");
    auto running = stub().RunJob(&context, job());
    pb::RunJobResponse accepted;
    ASSERT_TRUE(running->Read(&accepted));
    expect_status(submit_as("alice"), StatusCode::RESOURCE_EXHAUSTED,
                  {"quota jobs", "'alice'", "2 wait", "allowed: 2"});
    grpc::ClientContext more;
    name_token(more, "alice");
    auto another = stub().RunJob(&more, job());
    EXPECT_FALSE(another->Read(&accepted));
    expect_status(another->Finish(), StatusCode::RESOURCE_EXHAUSTED, {"quota jobs"});
    grpc::ClientContext compared;
    name_token(compared, "alice");
    pb::CompareRequest compare;
    compare.set_scene_id(scene_);
    for (const char* name : {"first", "second"}) {
      pb::CompareMode& mode = *compare.add_modes();
      mode.set_name(name);
      mode.mutable_settings()->set_width(16);
      mode.mutable_settings()->set_height(16);
    }
    compare.set_seeds(1);
    compare.add_samples(1);
    compare.mutable_reference()->mutable_rendered()->set_error(1);
    auto comparison = stub().Compare(&compared, compare);
    pb::CompareResponse unit;
    EXPECT_FALSE(comparison->Read(&unit));
    expect_status(comparison->Finish(), StatusCode::RESOURCE_EXHAUSTED, {"quota jobs"});
    EXPECT_TRUE(submit_as("bob").ok());
    context.TryCancel();
    while (running->Read(&accepted)) {
    }
    running->Finish();
  }
  std::string second;
  EXPECT_TRUE(eventually([&] { return submit_as("alice", &second).ok(); })) << "the place of the job that ended";
  expect_status(submit_as("alice"), StatusCode::RESOURCE_EXHAUSTED, {"quota jobs"});
  EXPECT_TRUE(cancel_as("alice", kept).ok());
  EXPECT_TRUE(eventually([&] { return submit_as("alice").ok(); }));
}

TEST_F(Quotas, OfMemoryCountFilmsQueuesAndUploads) {
  // A film of 256 x 256 takes 8 MiB (server/README.md, "Memory").
  start_for({.sessions = {}, .jobs = {}, .memory = 15 << 20});
  std::string first, second;
  ASSERT_TRUE(create_as("alice", scene_, 256, &first).ok());
  const grpc::Status large = create_as("alice", scene_, 1024);
  expect_status(large, StatusCode::RESOURCE_EXHAUSTED,
                {"quota memory", "'alice'", "a film of 1024 x 1024", "of 15728640 are left"});
  EXPECT_TRUE(create_as("bob", scene_, 1024).ok());
  // One's own session without a listener makes room; nobody else's does.
  std::string of_bob;
  ASSERT_TRUE(create_as("bob", scene_, 16, &of_bob).ok());
  ASSERT_TRUE(create_as("alice", scene_, 256, &second).ok());
  pb::ListSessionsResponse list;
  ASSERT_TRUE(call_as("bob", &Stub::ListSessions, pb::ListSessionsRequest(), &list).ok());
  std::set<std::string> there;
  for (const auto& session : list.sessions()) there.insert(session.session_id());
  EXPECT_TRUE(there.contains(of_bob));
  EXPECT_TRUE(there.contains(second));
  EXPECT_FALSE(there.contains(first));

  TokenStream listener(stub(), token("alice"), second);
  ASSERT_TRUE(listener.opened());
  Upload upload;
  upload.bytes = std::string(15 << 20, ' ');
  grpc::ClientContext context;
  name_token(context, "alice");
  pb::LoadSceneResponse loaded;
  auto writer = stub().LoadScene(&context, &loaded);
  writer->Write(upload.begin());
  writer->WritesDone();
  expect_status(writer->Finish(), StatusCode::RESOURCE_EXHAUSTED, {"quota memory", "the uploaded bundle"});
}

TEST_F(Quotas, AreThoseOfTheFileAsItIsNow) {
  start_for({.sessions = 0, .jobs = {}, .memory = {}});
  spdlog::set_level(spdlog::level::off);
  expect_status(create_as("alice", scene_, 16), StatusCode::RESOURCE_EXHAUSTED, {"quota sessions", "allowed: 0"});
  write_file(in("tokens"), to_token_line({"alice", Role::render, {}, AccessTokens::digest_of(token("alice"))}));
  server_->reload();
  EXPECT_TRUE(create_as("alice", scene_, 16).ok());
}

// However many sessions each has: owners have equal shares of the machine.
TEST_F(Quotas, OwnersShareTheMachine) {
  add_token("root", Role::admin);
  start_for({});
  std::vector<std::unique_ptr<TokenStream>> streams;
  std::set<std::string> of_alice;
  const auto open = [&](const std::string& name) {
    std::string id;
    ASSERT_TRUE(create_as(name, scene_, 48, &id, kNoEnd).ok());
    if (name == "alice") of_alice.insert(id);
    streams.push_back(std::make_unique<TokenStream>(stub(), token(name), id));
    ASSERT_TRUE(streams.back()->opened());
    streams.back()->send(view(1));
  };
  for (int i = 0; i < 6; ++i) open("alice");
  open("bob");
  const auto paths = [&] {
    std::map<std::string, double> paths;
    pb::ListSessionsResponse list;
    EXPECT_TRUE(call_as("root", &Stub::ListSessions, pb::ListSessionsRequest(), &list).ok());
    for (const pb::SessionInfo& session : list.sessions())
      paths[session.session_id()] = double(session.progress().paths());
    return paths;
  };
  std::map<std::string, double> before;
  ASSERT_TRUE(eventually([&] {
    before = paths();
    return std::all_of(before.begin(), before.end(), [](const auto& one) { return one.second > 1e5; });
  }));
  double alice = 0, bob = 0;
  ASSERT_TRUE(eventually([&] {
    alice = bob = 0;
    for (const auto& [id, now] : paths()) (of_alice.contains(id) ? alice : bob) += now - before.at(id);
    return alice + bob >= 4e6;
  }));
  std::printf("six sessions of one owner had %.1f %% of %.3g samples\n", 100 * alice / (alice + bob), alice + bob);
  EXPECT_GT(alice / (alice + bob), 0.45);
  EXPECT_LT(alice / (alice + bob), 0.55);
}

TEST(MemoryShares, CountInTheirOwnAccountAndInTheWhole) {
  MemoryAccount whole(1000);
  MemoryAccount share(whole, "alice", nullptr), other(whole, "bob", nullptr);
  share.set_limit(300);
  auto held = share.reserve(200, "a test");
  ASSERT_TRUE(held.ok());
  EXPECT_EQ(share.used(), 200u);
  EXPECT_EQ(whole.used(), 200u);
  const auto refused = share.reserve(101, "a test");
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find(
                "quota memory of the token 'alice': 101 bytes are needed for a test, 100 of 300 are left"),
            std::string::npos)
      << refused.error().message;
  auto much = other.reserve(750, "a test");
  ASSERT_TRUE(much.ok());
  const auto full = share.reserve(60, "a test");
  ASSERT_FALSE(full.ok());
  EXPECT_NE(full.error().message.find("max_memory"), std::string::npos) << full.error().message;
  EXPECT_EQ(share.used(), 200u) << "what the whole refuses is not kept in the share";
  EXPECT_EQ(share.available(), 50u);
  share.set_limit(100);  // less than is held
  EXPECT_EQ(share.available(), 0u);
  EXPECT_FALSE(share.reserve(1, "a test").ok());
  held->release();
  much->release();
  EXPECT_EQ(whole.used(), 0u);
  GrowingReservation growing(share);
  EXPECT_TRUE(growing.grow(60));
  EXPECT_FALSE(growing.grow(60));
  EXPECT_EQ(whole.used(), 60u);
  auto part = growing.split(40, "a test");
  ASSERT_TRUE(part.ok());
  growing.shrink(20);
  EXPECT_EQ(share.used(), 40u);
  part->release();
  EXPECT_EQ(whole.used(), 0u);
}

}  // namespace
}  // namespace helio::test
