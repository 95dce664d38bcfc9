#include "worlds/loader/sdf_masses.h"

#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "lpss/model/limits.h"
#include "worlds/loader/inertia.h"
#include "worlds/loader/massless_links.h"
#include "worlds/loader/repairs.h"

namespace tessera {

using xml::Element;

namespace {

constexpr std::array<const char*, 3> kMoments = {"ixx", "iyy", "izz"};
constexpr std::array<const char*, 3> kProducts = {"ixy", "ixz", "iyz"};

// Missing children have SDF's default values.
absl::StatusOr<Eigen::Vector3d> three_numbers(const Element& parent, const std::array<const char*, 3>& names,
                                              double otherwise) {
  Eigen::Vector3d numbers = Eigen::Vector3d::Constant(otherwise);
  for (std::size_t n = 0; n < names.size(); ++n) {
    const Element* child = parent.FirstChildElement(names[n]);
    if (child == nullptr) continue;
    const absl::StatusOr<double> number = xml::number_of(*child);
    if (!number.ok()) return number.status();
    numbers[static_cast<Eigen::Index>(n)] = *number;
  }
  return numbers;
}

// The mass properties of an <inertial>, or of a link without one.
absl::StatusOr<MassProperties> mass_properties(const Element* inertial) {
  MassProperties result;
  if (inertial == nullptr) return result;
  if (const Element* mass = inertial->FirstChildElement("mass")) {
    const absl::StatusOr<double> kilograms = xml::number_of(*mass);
    if (!kilograms.ok()) return kilograms.status();
    if (*kilograms < 0) {
      return xml::invalid(*mass, "mass = ", *kilograms, " kg must be at least ", kMassMin, " kg");
    }
    result.mass = *kilograms;
  }
  if (const Element* inertia = inertial->FirstChildElement("inertia")) {
    const absl::StatusOr<Eigen::Vector3d> moments = three_numbers(*inertia, kMoments, 1);
    if (!moments.ok()) return moments.status();
    const absl::StatusOr<Eigen::Vector3d> products = three_numbers(*inertia, kProducts, 0);
    if (!products.ok()) return products.status();
    result.moments = *moments;
    result.products = *products;
  }
  return result;
}

void set_mass_properties(const MassProperties& properties, Element& inertial) {
  for (const char* name : {"mass", "inertia"}) {
    if (Element* old = inertial.FirstChildElement(name)) inertial.DeleteChild(old);
  }
  xml::set_number(*inertial.InsertNewChildElement("mass"), properties.mass);
  Element& inertia = *inertial.InsertNewChildElement("inertia");
  for (int n = 0; n < 3; ++n) {
    xml::set_number(*inertia.InsertNewChildElement(kMoments[n]), properties.moments[n]);
    xml::set_number(*inertia.InsertNewChildElement(kProducts[n]), properties.products[n]);
  }
}

}  // namespace

absl::Status repair_inertial(Element& inertial, Notices& notices) {
  absl::StatusOr<MassProperties> properties = mass_properties(&inertial);
  if (!properties.ok()) return properties.status();
  const std::vector<std::string> faults = repair(*properties);
  if (faults.empty()) return absl::OkStatus();
  for (const std::string& fault : faults) notices.count_repair(fault, xml::place_of(inertial));
  set_mass_properties(*properties, inertial);
  return absl::OkStatus();
}

absl::Status repair_massless_links(Element& model, Notices& notices) {
  std::vector<Element*> links;
  std::vector<LinkMass> masses;
  absl::flat_hash_map<std::string, std::size_t> places;
  bool massless = false;
  for (Element* link = model.FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link")) {
    const absl::StatusOr<MassProperties> properties = mass_properties(link->FirstChildElement("inertial"));
    if (!properties.ok()) return properties.status();
    if (const char* name = link->Attribute("name")) places.emplace(name, links.size());
    links.push_back(link);
    masses.push_back({properties->mass, properties->moments.mean()});
    massless = massless || properties->mass == 0;
  }
  if (!massless) return absl::OkStatus();
  std::vector<std::pair<std::size_t, std::size_t>> joints;
  for (const Element* joint = model.FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    const auto parent = places.find(xml::child_text(*joint, "parent"));
    const auto child = places.find(xml::child_text(*joint, "child"));
    if (parent != places.end() && child != places.end()) joints.emplace_back(parent->second, child->second);
  }
  const std::vector<LinkMass> before = masses;
  give_least_masses(masses, joints);
  for (std::size_t n = 0; n < links.size(); ++n) {
    if (before[n].mass != 0) continue;
    notices.count_repair(kMasslessLink, xml::place_of(*links[n]));
    set_mass_properties({masses[n].mass, Eigen::Vector3d::Constant(masses[n].moment)},
                        *links[n]->FirstChildElement("inertial"));
  }
  return absl::OkStatus();
}

}  // namespace tessera
