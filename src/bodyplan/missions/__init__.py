"""Ready missions (TOML) and their schema."""

from bodyplan.missions.files import Mission, load_mission, parse_mission, ready_missions

__all__ = ["Mission", "load_mission", "parse_mission", "ready_missions"]
