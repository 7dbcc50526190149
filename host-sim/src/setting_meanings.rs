//! What the settings of a controller mean, in a few words: for people, so not in the controller.

/// Name and meaning of every setting.
pub const MEANINGS: &[(&str, &str)] = &[
    ("vehicle.wheelbase", "from the rear axle to the steering axis"),
    ("vehicle.drive_scale", "way of the driving wheel for one tick; negative if it counts the wrong way"),
    ("vehicle.steering_scale", "steering angle for one tick; negative if it counts the wrong way"),
    ("vehicle.steering_offset_forward", "steering angle at the count 0, driving forward"),
    ("vehicle.steering_offset_backward", "the same, driving backward"),
    ("vehicle.drive_counter_values", "values that the driving wheel's counter takes before it begins again"),
    ("vehicle.steering_counter_values", "the same of the steering's counter"),
    ("laser.x", "where the laser is, ahead of the rear axle"),
    ("laser.y", "where the laser is, to the left"),
    ("laser.theta", "direction of the laser, counter-clockwise"),
    ("odometry.speed_deviation", "noise of a reported speed"),
    ("odometry.steering_deviation", "noise of a steering angle"),
    ("odometry.slip", "noise of the way"),
    ("odometry.side_slip", "shift to the side"),
    ("odometry.yaw", "walk of the heading"),
    ("odometry.unknown_acceleration", "acceleration that may go on while the encoders are not believed"),
    ("odometry.unknown_turn", "turning that may begin while the encoders are not believed"),
    ("odometry.turn", "walk of the heading for a turn, on the spot too"),
    ("sources.reflectors", "whether reflectors correct the pose"),
    ("sources.corners", "whether corners correct the pose"),
    ("sources.end_points", "whether end points of walls correct the pose"),
    ("sources.key_scans", "whether key scans correct the pose"),
    ("sources.given_pose", "whether poses that are given correct the pose"),
    ("sources.aids", "whether observations of models of one's own correct the pose"),
    ("maps.reflectors", "whether the map's reflectors are used"),
    ("maps.features", "whether the map's natural features are used"),
    ("maps.dynamic", "whether features that are found while driving are used"),
    ("maps.start_search", "whether a vehicle that does not know where it is searches itself among the reflectors"),
    ("maps.slam", "whether features are found in the state of the filter"),
    ("reflectors.range_deviation", "noise of a reflector's distance"),
    ("reflectors.bearing_deviation", "noise of a reflector's direction"),
    ("features.nearest", "nearest range in which features are looked for: what is nearer is the vehicle itself"),
    ("features.farthest", "farthest range in which features are looked for"),
    ("features.added_deviation", "noise of a feature beside what the detector states"),
    ("features.motion_correction", "whether a scan is corrected for the vehicle's motion"),
    ("association.reflector_radius", "how far from its place in the map a reflector may be seen"),
    ("association.feature_radius", "how far from its place in the map a feature may be seen"),
    ("association.gate", "largest squared Mahalanobis distance"),
    ("association.margin", "by how much the second best landmark must be worse"),
    ("association.shared_map_error", "how many observations in a row share the error of a landmark's place"),
    ("dynamic_map.update_rate", "how fast a found landmark follows what is seen"),
    ("dynamic_map.first_hits", "hits that a found landmark begins with"),
    ("dynamic_map.most_hits", "most hits that it can have"),
    ("dynamic_map.least_hits", "hits from which on it corrects the pose"),
    ("dynamic_map.deviation", "error of a found landmark's place"),
    ("consistency.memory", "share of the past that counts from one observation to the next"),
    ("consistency.least_remaining", "share of the past that counts at least"),
    ("consistency.least_observations", "observations before anything is said of them"),
    ("consistency.least_acceptance", "share that must fit the map"),
    ("consistency.largest_normalised_square", "mean squared innovation from which on the filter is too sure"),
    ("limits.fastest", "fastest that the vehicle drives"),
    ("limits.dead_reckoning_from", "way without landmarks after which the pose rests on the odometry alone"),
    ("limits.lost_after", "way without landmarks after which the vehicle is lost"),
    ("limits.largest_position_deviation", "standard deviation of the position at which the vehicle is lost"),
    ("limits.largest_heading_deviation", "standard deviation of the heading at which the vehicle is lost"),
    ("limits.longest_extrapolation", "longest that the pose is carried on without encoders"),
    ("alert_limits.travel.position", "largest error of the position that travelling can live with"),
    ("alert_limits.travel.heading", "largest error of the heading that travelling can live with"),
    ("alert_limits.docking.position", "largest error of the position that docking can live with"),
    ("alert_limits.docking.heading", "largest error of the heading that docking can live with"),
    ("integrity.protection", "whether the error of the pose is bounded; without it nothing is available"),
    ("assumed.mounting", "deviation of the laser's place on the vehicle"),
    ("assumed.mounting_yaw", "deviation of the laser's yaw on the vehicle"),
    ("assumed.clock", "deviation of the laser's clock"),
    ("assumed.scale", "deviation of the scale of the distance travelled"),
    ("assumed.steering", "deviation of the steering angle's offset"),
    ("assumed.turn", "deviation of the wheelbase, as a share"),
    ("can.controller_node", "node of the controller on the CAN bus"),
    ("can.drive_node", "node of the driving wheel's encoder"),
    ("can.steering_node", "node of the steering's encoder"),
    ("can.encoder_period", "time between positions of the encoders"),
    ("network.address", "address of the controller"),
    ("network.prefix", "length of the network's prefix, bits"),
    ("network.gateway", "the way to other networks"),
    ("nav350.address", "address of the laser"),
    ("nav350.port", "its port"),
    ("log.port", "port of the log stream"),
    ("service.port", "port of the service"),
];

/// What a setting means; empty if there is none of that name.
#[must_use]
pub fn meaning(name: &str) -> &'static str {
    MEANINGS.iter().find(|(known, _)| *known == name).map_or("", |(_, meaning)| meaning)
}

#[cfg(test)]
mod tests {
    use super::MEANINGS;

    #[test]
    fn every_setting_is_explained_once_and_in_order() {
        let names: Vec<&str> = agv_settings::LEAVES.iter().map(|leaf| leaf.name).collect();
        assert_eq!(MEANINGS.iter().map(|(name, _)| *name).collect::<Vec<_>>(), names);
        assert!(MEANINGS.iter().all(|(_, meaning)| meaning.len() > 5));
    }
}
