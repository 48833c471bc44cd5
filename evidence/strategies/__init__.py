"""All strategies of harmonic selection on the same cases, and how often their alarms are false or missing."""
