"""Tables for people and for learning management systems, validated before anything is written."""
