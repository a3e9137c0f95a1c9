// Weighted-fair queue over clients (render loops) that share the workers: hierarchical start-time fair queueing (Goyal,
// Guo, Vin 1996; Goyal, Vin, Cheng 1996) over the time that each has used. Groups with something to run share in
// proportion to their weights, the owners of a group's clients evenly, and the clients of an owner evenly.
//
// A plain data structure: its owner locks it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace helio {

class FairQueue {
 public:
  using Id = std::uint64_t;

  // weights: of the groups, > 0.
  explicit FairQueue(const std::vector<double>& weights);

  // owner: whose client it is; clients of "" are one owner's, too.
  Id add(std::size_t group, const std::string& owner = {});
  void remove(Id id);  // precondition: nothing of it is in flight

  // Says if the client has something to run. One that was idle starts level with those that were not, and so does an
  // owner or a group of whom all were: idling saves up no credit.
  void set_ready(Id id, bool ready);
  bool any_ready() const;  // of those that may have a turn

  // Nobody else has a turn from now on; nothing: everyone has, again. What the holder uses meanwhile counts against
  // nobody: turns go on afterwards as if it had not been. A client that is removed holds no longer.
  void hold(std::optional<Id> id) { holder_ = id; }
  std::optional<Id> holder() const { return holder_; }

  // The client whose turn it is, charged in advance with what its pieces usually take.
  std::optional<Id> take();
  void finish(Id id, double seconds);

  int in_flight(Id id) const { return clients_.at(id).in_flight; }
  double used_seconds(Id id) const { return clients_.at(id).used_seconds; }
  double used_seconds() const { return used_seconds_; }  // of all clients that there ever were

 private:
  struct Share {
    int ready = 0, in_flight = 0;  // clients | pieces
    double virtual_time = 0;       // seconds; of a group over its weight
    double inner_time = 0;         // virtual time, one level below, at which its last piece was handed out
  };
  struct Owner : Share {
    int clients = 0;
  };
  struct Group : Share {
    double weight = 1;
    std::map<std::string, Owner> owners;  // of its clients
  };
  struct Client {
    Group* group = nullptr;
    std::map<std::string, Owner>::iterator owner;
    bool ready = false;
    int in_flight = 0;
    double virtual_time = 0;  // seconds
    double used_seconds = 0;
    double piece_seconds = 1e-3;  // running mean of what a piece takes
    double charged_ahead = 0;     // seconds charged for pieces in flight
  };
  static void charge(Client& client, double seconds);
  static void wake(Share& share, double least_time);  // one more of its clients is ready

  std::vector<Group> groups_;
  std::map<Id, Client> clients_;
  std::optional<Id> holder_;
  double used_seconds_ = 0;
  double group_time_ = 0;  // virtual time of the group of which the last piece was handed out
  Id next_id_ = 1;
};

}  // namespace helio
