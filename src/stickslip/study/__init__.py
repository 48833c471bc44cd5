"""From study files to datasets: tables, models, jobs and results."""
