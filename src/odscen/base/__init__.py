"""What every room builds on: errors, ids, frames, units of time, arrays, whole files and markup."""
