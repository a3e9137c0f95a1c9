#include "renderer/frame/fair_queue.h"

#include <algorithm>

#include "renderer/base/check.h"

namespace helio {

FairQueue::FairQueue(const std::vector<double>& weights) : groups_(weights.size()) {
  for (std::size_t g = 0; g < weights.size(); ++g) groups_[g].weight = weights[g];
}

FairQueue::Id FairQueue::add(std::size_t group, const std::string& owner) {
  Client client;
  client.group = &groups_.at(group);
  const auto [found, is_new] = client.group->owners.try_emplace(owner);
  if (is_new) found->second.virtual_time = client.group->inner_time;
  client.owner = found;
  client.virtual_time = found->second.inner_time;
  try {
    clients_.emplace(next_id_, client);
  } catch (...) {
    if (is_new) client.group->owners.erase(found);
    throw;
  }
  ++found->second.clients;
  return next_id_++;
}

void FairQueue::remove(Id id) {
  HELIO_DCHECK(clients_.at(id).in_flight == 0);
  set_ready(id, false);
  if (holder_ == id) holder_.reset();
  const Client& client = clients_.at(id);
  if (--client.owner->second.clients == 0) client.group->owners.erase(client.owner);
  clients_.erase(id);
}

void FairQueue::wake(Share& share, double least_time) {
  if (share.ready == 0 && share.in_flight == 0) share.virtual_time = std::max(share.virtual_time, least_time);
  ++share.ready;
}

void FairQueue::set_ready(Id id, bool ready) {
  Client& client = clients_.at(id);
  if (ready == client.ready) return;
  client.ready = ready;
  Group& group = *client.group;
  Owner& owner = client.owner->second;
  if (!ready) {
    --owner.ready;
    --group.ready;
    return;
  }
  if (client.in_flight == 0) client.virtual_time = std::max(client.virtual_time, owner.inner_time);
  wake(owner, group.inner_time);
  wake(group, group_time_);
}

bool FairQueue::any_ready() const {
  if (holder_) return clients_.at(*holder_).ready;
  return std::any_of(groups_.begin(), groups_.end(), [](const Group& group) { return group.ready > 0; });
}

void FairQueue::charge(Client& client, double seconds) {
  client.virtual_time += seconds;
  client.owner->second.virtual_time += seconds;
  client.group->virtual_time += seconds / client.group->weight;
}

std::optional<FairQueue::Id> FairQueue::take() {
  auto best = clients_.end();
  if (holder_) {
    best = clients_.find(*holder_);
    if (!best->second.ready) return std::nullopt;
  } else {
    const auto earlier = [](const auto& a, const auto& b) { return a.virtual_time < b.virtual_time; };
    const Group* group = nullptr;
    for (const Group& g : groups_)
      if (g.ready > 0 && (!group || earlier(g, *group))) group = &g;
    if (!group) return std::nullopt;
    const Owner* owner = nullptr;
    for (const auto& [name, o] : group->owners)
      if (o.ready > 0 && (!owner || earlier(o, *owner))) owner = &o;
    for (auto it = clients_.begin(); it != clients_.end(); ++it) {
      const Client& c = it->second;
      if (!c.ready || &c.owner->second != owner) continue;
      if (best == clients_.end() || earlier(c, best->second)) best = it;
    }
  }
  Client& client = best->second;
  Group& group = *client.group;
  Owner& owner = client.owner->second;
  for (int* pieces : {&client.in_flight, &owner.in_flight, &group.in_flight}) ++*pieces;
  if (holder_) return best->first;
  group_time_ = std::max(group_time_, group.virtual_time);
  group.inner_time = std::max(group.inner_time, owner.virtual_time);
  owner.inner_time = std::max(owner.inner_time, client.virtual_time);
  client.charged_ahead += client.piece_seconds;
  charge(client, client.piece_seconds);
  return best->first;
}

void FairQueue::finish(Id id, double seconds) {
  Client& client = clients_.at(id);
  const double ahead = client.charged_ahead / client.in_flight;
  client.charged_ahead -= ahead;
  for (int* pieces : {&client.in_flight, &client.owner->second.in_flight, &client.group->in_flight}) --*pieces;
  if (holder_ != id) charge(client, seconds - ahead);
  client.used_seconds += seconds;
  used_seconds_ += seconds;
  client.piece_seconds += 0.1 * (seconds - client.piece_seconds);
}

}  // namespace helio
