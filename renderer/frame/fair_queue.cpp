#include "renderer/frame/fair_queue.h"

#include <algorithm>

#include "renderer/base/check.h"

namespace helio {

FairQueue::FairQueue(const std::vector<double>& weights) : groups_(weights.size()) {
  for (std::size_t g = 0; g < weights.size(); ++g) groups_[g].weight = weights[g];
}

FairQueue::Id FairQueue::add(std::size_t group) {
  Client client;
  client.group = &groups_.at(group);
  client.virtual_time = client.group->client_time;
  clients_.emplace(next_id_, client);
  return next_id_++;
}

void FairQueue::remove(Id id) {
  HELIO_DCHECK(clients_.at(id).in_flight == 0);
  set_ready(id, false);
  if (holder_ == id) holder_.reset();
  clients_.erase(id);
}

void FairQueue::set_ready(Id id, bool ready) {
  Client& client = clients_.at(id);
  if (ready == client.ready) return;
  client.ready = ready;
  Group& group = *client.group;
  if (!ready) {
    --group.ready;
    return;
  }
  if (client.in_flight == 0) client.virtual_time = std::max(client.virtual_time, group.client_time);
  if (group.ready == 0 && group.in_flight == 0) group.virtual_time = std::max(group.virtual_time, group_time_);
  ++group.ready;
}

bool FairQueue::any_ready() const {
  if (holder_) return clients_.at(*holder_).ready;
  return std::any_of(groups_.begin(), groups_.end(), [](const Group& group) { return group.ready > 0; });
}

void FairQueue::charge(Client& client, double seconds) {
  client.virtual_time += seconds;
  client.group->virtual_time += seconds / client.group->weight;
}

std::optional<FairQueue::Id> FairQueue::take() {
  Group* group = nullptr;
  for (Group& g : groups_) {
    if (holder_ && clients_.at(*holder_).group != &g) continue;
    if (g.ready > 0 && (!group || g.virtual_time < group->virtual_time)) group = &g;
  }
  if (!group) return std::nullopt;
  auto best = clients_.end();
  for (auto it = clients_.begin(); it != clients_.end(); ++it) {
    const Client& c = it->second;
    if (!c.ready || c.group != group || !may_run(it->first)) continue;
    if (best == clients_.end() || c.virtual_time < best->second.virtual_time) best = it;
  }
  if (best == clients_.end()) return std::nullopt;  // another of the holder's group
  Client& client = best->second;
  group_time_ = std::max(group_time_, group->virtual_time);
  group->client_time = std::max(group->client_time, client.virtual_time);
  ++client.in_flight;
  ++group->in_flight;
  client.charged_ahead += client.piece_seconds;
  charge(client, client.piece_seconds);
  return best->first;
}

void FairQueue::finish(Id id, double seconds) {
  Client& client = clients_.at(id);
  const double ahead = client.charged_ahead / client.in_flight;
  client.charged_ahead -= ahead;
  --client.in_flight;
  --client.group->in_flight;
  charge(client, seconds - ahead);
  client.used_seconds += seconds;
  used_seconds_ += seconds;
  client.piece_seconds += 0.1 * (seconds - client.piece_seconds);
}

}  // namespace helio
