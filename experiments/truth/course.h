// What happened in a world, tick by tick, whoever simulates it.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "cli/measure/local_world.h"
#include "lpss/model/world_description.h"
#include "lpss/tick/messages.h"

namespace tessera::truth {

// A body between two ticks, relative to the centre of the anchor's sector.
struct Glance {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  // m, of the body frame
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // m/s, of the centre of mass
  Eigen::Vector3d spin = Eigen::Vector3d::Zero();      // rad/s
  bool asleep = false;
};

// All bodies that can move, at the start and after each tick, or after each `every` of them.
class Course {
 public:
  explicit Course(const WorldDescription& world, Tick every = 1);

  const WorldDescription& world() const { return world_; }
  double dt() const { return world_.settings.time_step; }
  double seconds() const { return static_cast<double>(ticks_) * dt(); }
  Tick ticks() const { return ticks_; }
  std::size_t diverged() const { return diverged_; }

  // The body of that name, which the world has.
  BodyId id(const std::string& body) const;
  // At the start, then after each `every` ticks: never empty for a body that can move.
  const std::vector<Glance>& of(const std::string& body) const { return glances_.at(id(body)); }
  const Glance& first(const std::string& body) const { return of(body).front(); }
  const Glance& last(const std::string& body) const { return of(body).back(); }
  // The one nearest in time.
  const Glance& at(const std::string& body, double seconds) const;
  // Those from `from` s on, up to `to` s.
  std::span<const Glance> between(const std::string& body, double from, double to = 1e9) const;

  // What the body's program publishes under that name, at the end: of several programs, the first with it.
  double published(const std::string& body, const std::string& value) const;

  // By tick from 1 on; empty unless they are kept.
  const std::vector<std::vector<ContactEvent>>& contacts() const { return contacts_; }

  void look(const std::vector<BodyRecord>& bodies);
  void end_tick(const LocalWorld& local, bool keeps_contacts);

 private:
  WorldDescription world_;
  std::map<std::string, BodyId> ids_;
  std::map<BodyId, std::vector<Glance>> glances_;
  std::map<BodyId, std::vector<ProgramRecord>> programs_;  // of the last sample
  std::vector<std::vector<ContactEvent>> contacts_;
  Tick every_ = 1;
  Tick ticks_ = 0;
  std::size_t diverged_ = 0;
};

// What is commanded at the beginning of the tick that comes next.
using Script = std::function<std::vector<Command>(const Course& so_far)>;

// Steps for so long, by the time step of the world.
void run(LocalWorld& local, double seconds, const Script& script, Course& course,
         bool keeps_contacts = false);

// The kinematic body arrives there at the end of the next tick; m, from the centre of the anchor's sector.
Command move_to(const Course& course, const std::string& body, const Eigen::Vector3d& place,
                const Eigen::Quaterniond& turn = Eigen::Quaterniond::Identity());

// --- what can be said of a course ---

// m, the largest way of the body frame from where it is at `from` s, up to `to`.
double way(const Course& course, const std::string& body, double from, double to = 1e9);

// J, of the bodies that can move, after so many samples; potential in uniform gravity, about the anchor's
// centre.
double energy(const Course& course, std::size_t sample);
// The largest energy of all, over that at the start, minus 1.
double energy_gain(const Course& course);

}  // namespace tessera::truth
