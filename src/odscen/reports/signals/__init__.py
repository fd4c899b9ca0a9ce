"""Traffic lights in reports: tables, charts, diagrams, sheets."""
